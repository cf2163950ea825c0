#pragma once

#include <cstddef>
#include <vector>

namespace raylign {

/// A 2-D float image, row-major, row 0 on top; integer coordinates are pixel centres.
struct Image {
    int width = 0;
    int height = 0;
    std::vector<float> pixels;

    Image() = default;
    Image(int width_px, int height_px, float value = 0)
        : width(width_px), height(height_px), pixels(static_cast<std::size_t>(width_px) * height_px, value) {}

    [[nodiscard]] bool empty() const { return pixels.empty(); }
    [[nodiscard]] std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * width + x; }
    [[nodiscard]] float operator()(int x, int y) const { return pixels[index(x, y)]; }
    [[nodiscard]] float& operator()(int x, int y) { return pixels[index(x, y)]; }
};

}  // namespace raylign

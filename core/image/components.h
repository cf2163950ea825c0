#pragma once

#include <cstddef>
#include <vector>

namespace raylign::detail {

/// A connected piece of a picture.
struct Component {
    std::vector<std::size_t> pixels;  ///< indices, row-major
    int low_x = 0, high_x = 0, low_y = 0, high_y = 0;
};

/// The 8-connected pieces of the true pixels, in the order of their first pixel.
[[nodiscard]] inline std::vector<Component> components_of(std::vector<bool> pixels, int width, int height) {
    std::vector<Component> pieces;
    for (std::size_t first = 0; first < pixels.size(); ++first) {
        if (!pixels[first]) continue;
        pixels[first] = false;
        Component piece{{first}, width, -1, height, -1};
        for (std::size_t k = 0; k < piece.pixels.size(); ++k) {  // grows while it is walked
            const int x = static_cast<int>(piece.pixels[k] % static_cast<std::size_t>(width));
            const int y = static_cast<int>(piece.pixels[k] / static_cast<std::size_t>(width));
            piece.low_x = x < piece.low_x ? x : piece.low_x;
            piece.high_x = x > piece.high_x ? x : piece.high_x;
            piece.low_y = y < piece.low_y ? y : piece.low_y;
            piece.high_y = y > piece.high_y ? y : piece.high_y;
            for (int n = 0; n < 9; ++n) {
                const int u = x + n % 3 - 1, v = y + n / 3 - 1;
                if (u < 0 || v < 0 || u >= width || v >= height) continue;
                const std::size_t i =
                    static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
                if (!pixels[i]) continue;
                pixels[i] = false;
                piece.pixels.push_back(i);
            }
        }
        pieces.push_back(std::move(piece));
    }
    return pieces;
}

}  // namespace raylign::detail

#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace raylign::detail {

struct RgbImage {
    int width = 0, height = 0;
    std::vector<std::array<std::uint8_t, 3>> pixels;  ///< row-major, row 0 on top
};
/// Writes an 8-bit RGB PNG, to a temporary name first.
void write_png(const std::filesystem::path& path, const RgbImage& image);

}  // namespace raylign::detail

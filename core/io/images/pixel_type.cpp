#include <array>

#include "core/io/images/raster.h"

namespace raylign::detail {

std::string pixel_type_name(PixelType type) {
    constexpr std::array<const char*, 10> kNames = {"uint8", "int8",   "uint16", "int16",   "uint32",
                                                    "int32", "uint64", "int64",  "float32", "float64"};
    return kNames[static_cast<std::size_t>(type)];
}

bool is_integer(PixelType type) { return type != PixelType::f32 && type != PixelType::f64; }

std::size_t bytes_of(PixelType type) {
    constexpr std::array<std::size_t, 10> kBytes = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
    return kBytes[static_cast<std::size_t>(type)];
}

std::size_t Raster::pixel_count() const {
    std::size_t count = 1;
    for (const int n : size) count *= static_cast<std::size_t>(n);
    return count;
}

void set_size(Raster& raster, const std::vector<int>& size) {
    const auto dimensions = static_cast<Eigen::Index>(size.size());
    raster.size = size;
    raster.spacing_mm.assign(size.size(), 1);
    raster.origin_mm.assign(size.size(), 0);
    raster.direction = Eigen::MatrixXd::Identity(dimensions, dimensions);
}

std::string size_text(std::span<const int> size) {
    std::string text;
    for (const int n : size) {
        if (!text.empty()) text += " x ";
        text += std::to_string(n);
    }
    return text;
}

}  // namespace raylign::detail

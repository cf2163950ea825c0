#include "core/image/saturation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/image/components.h"

namespace raylign::detail {
namespace {

constexpr int kRadius_px = 3;
constexpr double kFlat = 0.05;    // of the range: quantization and noise of 8-bit fluoroscopy are 2 to 3 %
constexpr double kLeast = 0.003;  // of the usable pixels: a screw's head in a frame of a knee

/// A collimator reaches the image's edge; metal that lets nothing through may be as dark, to the count.
bool reaches_the_edge(const Component& piece, const Image& image) {
    return piece.low_x == 0 || piece.low_y == 0 || piece.high_x == image.width - 1 || piece.high_y == image.height - 1;
}

/// Pixels without a use are NaN.
std::vector<float> usable_pixels(const Image& image, const Image& weights) {
    std::vector<float> pixels = image.pixels;
    float largest = -std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        if (!weights.empty() && weights.pixels[i] == 0) pixels[i] = std::numeric_limits<float>::quiet_NaN();
        if (pixels[i] > largest) largest = pixels[i];
    }
    std::vector<bool> darkest;
    for (const float pixel : pixels) darkest.push_back(pixel == largest);
    for (const Component& piece : components_of(darkest, image.width, image.height)) {
        if (!reaches_the_edge(piece, image)) continue;
        for (const std::size_t i : piece.pixels) pixels[i] = std::numeric_limits<float>::quiet_NaN();
    }
    return pixels;
}

/// Largest difference in the neighbourhood; infinite where that leaves the image or holds a pixel without a use.
float roughness(const std::vector<float>& pixels, int width, int height, int x, int y) {
    constexpr float kInfinite = std::numeric_limits<float>::infinity();
    if (x < kRadius_px || y < kRadius_px || x + kRadius_px >= width || y + kRadius_px >= height) return kInfinite;
    float low = kInfinite, high = -kInfinite;
    for (int v = y - kRadius_px; v <= y + kRadius_px; ++v) {
        for (int u = x - kRadius_px; u <= x + kRadius_px; ++u) {
            const float value =
                pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u)];
            if (std::isnan(value)) return kInfinite;
            low = std::min(low, value);
            high = std::max(high, value);
        }
    }
    return high - low;
}

}  // namespace

std::optional<Saturation> find_saturation(const Image& line_integral, const Image& weights) {
    const std::vector<float> pixels = usable_pixels(line_integral, weights);
    std::vector<double> sorted;
    for (const float pixel : pixels) {
        if (std::isfinite(pixel)) sorted.push_back(pixel);
    }
    if (sorted.empty()) return std::nullopt;
    std::ranges::sort(sorted);
    const auto at = [&](double share) {
        return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
    };
    const double range = at(0.98) - at(0.02), dense = (at(0.5) + at(0.98)) / 2;
    if (!(range > 0)) return std::nullopt;
    std::vector<double> flat;
    for (int y = 0; y < line_integral.height; ++y) {
        for (int x = 0; x < line_integral.width; ++x) {
            const float value = pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(line_integral.width) +
                                       static_cast<std::size_t>(x)];
            if (!(value > dense) || !(value > 0)) continue;
            if (roughness(pixels, line_integral.width, line_integral.height, x, y) <= kFlat * range) {
                flat.push_back(value);
            }
        }
    }
    const double share = static_cast<double>(flat.size()) / static_cast<double>(sorted.size());
    if (share < kLeast) return std::nullopt;
    const auto upper = flat.begin() + static_cast<std::ptrdiff_t>(3 * flat.size() / 4);
    std::ranges::nth_element(flat, upper);
    return Saturation{*upper, share};
}

}  // namespace raylign::detail

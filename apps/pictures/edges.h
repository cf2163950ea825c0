#pragma once

#include <cstdint>
#include <vector>

#include "raylign/image.h"

namespace raylign::detail::apps {

/// Contours, one byte per pixel, row-major: 0 = none, 1 to 8 = on a contour, by the direction in which the image rises
/// (sectors of 45 degrees).
struct EdgeMap {
    int width = 0, height = 0;
    std::vector<std::uint8_t> sectors;

    [[nodiscard]] std::uint8_t operator()(int x, int y) const {
        return sectors[static_cast<std::size_t>(y) * width + x];
    }
};

/// True where both are contours that rise in the same direction, give or take one sector: the two sides of a thin bone
/// are different contours.
[[nodiscard]] bool same_contour(std::uint8_t sector, std::uint8_t other);

/// Ridges of the gradient's magnitude, one pixel wide, relative to its neighbourhood.
struct RidgeMap {
    Image strength;                     ///< 0 off the ridges and where the mask reaches
    std::vector<std::uint8_t> sectors;  ///< 1 to 8, at every pixel
};

/// Gradient of a Gaussian (sigma in image px, in (0, 20]), divided by its mean around (so that the outline of the body
/// does not outshine bone), enlarged by `factor` and reduced to its ridges. Pixels near weight 0 (empty weights: none)
/// carry no ridge.
[[nodiscard]] RidgeMap find_ridges(const Image& image, const Image& weights, double sigma_px, int factor);

/// Contours as Canny [1986] follows them: hysteresis between `high`, above which the share `kept_share` of the ridge
/// pixels lies, and half of it. Contours shorter than `shortest_px` are noise and left out.
[[nodiscard]] EdgeMap find_edges(RidgeMap ridges, double kept_share, int shortest_px);

/// Every contour pixel grown to a disc of the given radius; where discs meet the later one in reading order stays.
[[nodiscard]] EdgeMap thickened(const EdgeMap& edges, int radius_px);

}  // namespace raylign::detail::apps

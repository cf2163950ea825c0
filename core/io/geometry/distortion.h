#pragma once

#include <optional>
#include <span>
#include <string>

#include "raylign/image.h"
#include "raylign/intensity.h"
#include "raylign/io/geometry.h"

namespace raylign::detail {

/// Coefficients in OpenCV's order: k1, k2, p1, p2, then k3, then k4, k5, k6. None where all are 0. Throws Error unless
/// there are 4, 5 or 8, or 12 or 14 whose last ones (thin prisms, a tilted sensor) are 0.
[[nodiscard]] std::optional<Distortion> distortion_from(std::span<const double> coefficients, const std::string& what,
                                                        const std::string& where);

/// Of the turned image.
[[nodiscard]] Distortion flipped(Distortion distortion, ImageFlip flip);

/// "k1 -0.2, k2 0.1, p1 0, p2 0, k3 0" and what follows, without what is 0 at the end.
[[nodiscard]] std::string distortion_text(const Distortion& distortion);

/// Where each pixel of the undistorted image lies in the distorted one; NaN where that does not show it.
struct PixelMap {
    Image x, y;
};
[[nodiscard]] PixelMap undistortion_map(const Camera& camera, const Distortion& distortion);

/// The undistorted image, bilinear; NaN where the distorted one shows nothing, which weighs 0 later. Empty stays empty.
[[nodiscard]] Image undistorted_image(const Image& image, const PixelMap& map);
/// Of a mask: 1 where all pixels that count are not 0, else 0.
[[nodiscard]] Image undistorted_mask(const Image& mask, const PixelMap& map);

/// Both of a file's pixels.
void undistort(RawXray& xray, const PixelMap& map);

}  // namespace raylign::detail

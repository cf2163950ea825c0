#pragma once

#include <array>
#include <vector>

#include "raylign/image.h"
#include "raylign/similarity.h"

namespace raylign::detail {

/// The two 1-D filters that make a gradient image: derivative along one axis, smoothing along the other.
struct GradientTaps {
    int radius_px = 0;
    std::vector<double> smooth;  ///< exp(-k^2 / 2 sigma^2), k = -R..R, scaled to sum 1
    /// k exp(-k^2 / 2 sigma^2), scaled so that sum k d_k = 1: a ramp of slope 1 gives 1.
    std::vector<double> derivative;
};

/// [Ino06] eq. 3-10 with unit gains, applied as a correlation: (d * f)(x) = sum_k d_k f(x + k) is positive where f
/// rises. Throws Error outside the ranges above.
[[nodiscard]] GradientTaps gradient_taps(const GradientFilter& filter);

/// dI/dx and dI/dy [1/px]: derivative along the axis, smoothing across it. Pixels outside the image repeat the nearest
/// one; fixed and moving images are treated alike, so the border brings no bias.
[[nodiscard]] std::array<Image, 2> gradient_images(const Image& image, const GradientTaps& taps);

/// Weights for the gradient images: a pixel keeps its weight only if no pixel within the filter's (2R + 1)^2 support
/// inside the image has weight 0, since a masked pixel's value is meaningless. Empty in, empty out.
[[nodiscard]] Image erode_weights(const Image& weights, int radius_px);

}  // namespace raylign::detail

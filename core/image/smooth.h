#pragma once

#include "raylign/image.h"

namespace raylign::detail {

/// Gaussian smoothing as three box filters [Wells86] of 2 r + 1 pixels, r (r + 1) nearest to sigma^2 and at least 2;
/// borders repeat. Time does not depend on sigma. Throws Error for a sigma outside [1, 1000] px.
[[nodiscard]] Image smoothed(const Image& image, double sigma_px);

}  // namespace raylign::detail

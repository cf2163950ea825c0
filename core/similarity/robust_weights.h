#pragma once

#include <span>

#include "core/similarity/similarity.h"

namespace raylign::detail {

/// Weights that take what the DRR cannot explain (metal, other bones, soft tissue that moved) out of the comparison:
/// iteratively reweighted least squares. Per channel, with weighted means and the least-squares gain of the moving
/// image, r_c = (A - mean A) - gain (B - mean B); per pixel r^2 = sum_c r_c^2 and
///   w = (1 + (r / (c s))^2)^-2,  c = 2.5,  s = median(r) / m,
/// m = 0.6745 for one channel and 1.1774 for two (the median of |r| and of a Rayleigh variable for unit normal noise).
/// A negative gain counts as none. Where fixed.weights is 0 the weight is 0 and the pixel takes no part in the median.
/// An image without residual (s = 0) keeps all pixels. The estimator: [Geman87].
/// `moving`: one image per channel, or none for weights that no pose decides (as if the DRR were empty): strong foreign
/// edges then weigh less whatever the pose.
/// Throws Error for sizes that disagree or no pixel with weight.
[[nodiscard]] Image robust_weights(const FixedChannels& fixed, std::span<const Image> moving);

}  // namespace raylign::detail

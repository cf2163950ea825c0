#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "core/image/gradient_filter.h"
#include "raylign/similarity.h"
#include "raylign/view.h"

namespace raylign::detail {

/// Weighted sums over the pixels of one channel: fixed image A, moving image B, weights w.
/// [Ino06] reads back five of these; the weight sum makes masks exact.
struct MomentSums {
    double weight = 0;         ///< sum w
    double fixed = 0;          ///< sum w A
    double fixed_fixed = 0;    ///< sum w A^2
    double moving = 0;         ///< sum w B
    double moving_moving = 0;  ///< sum w B^2
    double fixed_moving = 0;   ///< sum w A B

    MomentSums& operator+=(const MomentSums& other);
};

/// What a view is compared by: gc has two channels (d/dx, d/dy), ncc one (the image).
struct FixedChannels {
    std::vector<Image> channels;  ///< fixed images A, one per channel
    Image weights;                ///< w, the same for every channel; never empty
};

[[nodiscard]] int channel_count(Metric metric);

/// Images to channels: the filter of `similarity`, the view's weights eroded by its radius.
/// Throws Error for a missing or non-finite image, a size that differs from the camera's, weights that are negative or
/// not finite, fewer than `kMinPixels` usable pixels, or a constant channel (NCC undefined).
[[nodiscard]] FixedChannels make_fixed_channels(const View& view, const Similarity& similarity);
inline constexpr int kMinPixels = 32;  ///< below this, six pose parameters are not determined with any redundancy

/// One DRR to its channels, the same filter as the fixed image. The oracle for every backend's filter.
[[nodiscard]] std::vector<Image> moving_channels(const Image& drr, const Similarity& similarity);

/// Sums in double, rows first, then over rows. The oracle for every backend's sums.
[[nodiscard]] MomentSums moment_sums(const Image& fixed, const Image& moving, const Image& weights);

/// Weighted normalized cross correlation in [-1, 1], [Ino06] eq. 1:
///   N = (S_AB - S_A S_B / S_w) / sqrt((S_AA - S_A^2 / S_w) (S_BB - S_B^2 / S_w)).
/// A constant moving image (the DRR misses the detector) correlates with nothing: 0, by definition. NaN sums give NaN.
[[nodiscard]] double normalized_cross_correlation(const MomentSums& sums);

/// A variance below this share of the raw second moment is rounding error of float pixels, not signal.
inline constexpr double kConstantShare = 1e-12;
/// True where the moving image is constant over the usable pixels: no overlap with the detector.
[[nodiscard]] bool moving_is_constant(const MomentSums& sums);

/// Cost of one view: 1 - mean over channels of N, in [0, 2]; 0 = perfect, 1 = unrelated.
[[nodiscard]] double view_cost(std::span<const MomentSums> channels);

}  // namespace raylign::detail

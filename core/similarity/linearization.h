#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

#include "core/similarity/similarity.h"

namespace raylign::detail {

/// The sums of one channel that a Gauss-Newton step needs: the moments, and those with the six derivative images
/// J_i = dB / dp_i of the (filtered) moving image. Six moments (weights included) and 6 + 6 + 6 + 21 more. Plain
/// doubles, so that it travels.
struct JacobianSums {
    MomentSums moments;
    std::array<double, 6> jacobian{};            ///< sum w J_i
    std::array<double, 6> fixed_jacobian{};      ///< sum w A J_i
    std::array<double, 6> moving_jacobian{};     ///< sum w B J_i
    std::array<double, 21> jacobian_jacobian{};  ///< sum w J_i J_j, i <= j, rows of the upper triangle

    JacobianSums& operator+=(const JacobianSums& other);
};

/// Linearizes one channel's cost 1 - N. With a, b the mean-free unit-norm fixed and moving images, J~ the mean-free
/// derivative images and B~ the mean-free moving image: 1 - N = |a - b|^2 / 2,
///   gradient  = -(J~^T a - N J~^T b) / |B~|,
///   curvature = (J~^T J~ - (J~^T b)(J~^T b)^T) / |B~|^2  (Gauss-Newton: the second derivative of b is left out).
/// Derived from [Ino06] eq. 1. Where the moving image is constant: cost 1, no gradient, no curvature.
[[nodiscard]] Linearization linearize_channel(const JacobianSums& sums);

/// Linearizes view_cost, the mean over channels.
[[nodiscard]] Linearization linearize_view(std::span<const JacobianSums> channels);

/// Sums in double, pixel by pixel: the oracle. `jacobian`: the six filtered derivative images.
[[nodiscard]] JacobianSums jacobian_sums(const Image& fixed, const Image& moving, std::span<const Image, 6> jacobian,
                                         const Image& weights);

}  // namespace raylign::detail

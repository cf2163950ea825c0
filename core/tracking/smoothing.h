#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "raylign/rigid_transform.h"

namespace raylign::detail {

/// A pose of a track, frames at even distances.
struct TrackSample {
    std::optional<RigidTransform> world_from_ct;  ///< none = a gap
    double sigma = 1;                             ///< its expected error, in any unit: weights are 1 / sigma^2
};

/// What smoothing made of a track.
struct SmoothTrack {
    std::vector<std::optional<RigidTransform>> world_from_ct;  ///< gaps stay gaps
    double translation_strength = 0, rotation_strength = 0;    ///< lambda that was taken
};

/// Smooths on SE(3): with R_k, x_k the rotations and the places of a point of the object, S_k, y_k minimise
///   sum w_k |y_k - x_k|^2 + lambda sum |y_{k+1} - 2 y_k + y_{k-1}|^2  and
///   sum w_k |log(R_k^T S_k)|^2 + mu sum |log(S_k^T S_{k+1}) - log(S_{k-1}^T S_k)|^2
/// (a discrete smoothing spline [Whittaker23]; the second by Gauss-Newton). Weights have mean 1. lambda and mu: as
/// given, else by generalised cross-validation [Craven79], with the trace for equal weights, among powers of ten from
/// 1e-3 to 1e6. Fewer than four poses stay as they are. Throws Error for a sigma that is not positive.
[[nodiscard]] SmoothTrack smoothed(std::span<const TrackSample> track, const Eigen::Vector3d& point_ct_mm,
                                   std::optional<double> strength = {});

/// Root mean square second differences over sqrt(6), of neighbouring frames with poses: the noise of a steady motion.
struct TrackJitter {
    double translation_mm = 0, rotation_deg = 0;  ///< per axis
    std::size_t count = 0;                        ///< of second differences
};
[[nodiscard]] TrackJitter jitter_of(std::span<const TrackSample> track, const Eigen::Vector3d& point_ct_mm);

}  // namespace raylign::detail

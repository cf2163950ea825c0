#pragma once

#include <Eigen/Core>
#include <span>

#include "raylign/rigid_transform.h"

namespace raylign::detail {

/// A pose at a time, counted in frames.
struct TimedPose {
    double time = 0;
    RigidTransform world_from_ct;
};

/// The pose to expect at `time` from earlier ones (in order of time; at least one), with constant velocity. With R, x
/// the rotation and the place of the object's centre, of the last (k) and the last but one (k - 1):
///   w = log(R_k R_{k-1}^T) / (t_k - t_{k-1}),  v = (x_k - x_{k-1}) / (t_k - t_{k-1}),  h = g min(time - t_k, 2),
///   R = exp(h w) R_k,  x = x_k + h v.
/// The turn is taken about the centre, so that a turning object does not swing about a far origin. g = 0 where only one
/// pose is known or the last two lie more than 3 frames apart (their mean velocity says little), 1/2 where two are
/// known (the first frame may be off), else 1. Beyond 2 frames the prediction is held: a body that was lost for long
/// has rather turned back than gone on.
[[nodiscard]] RigidTransform extrapolate(std::span<const TimedPose> known, double time,
                                         const Eigen::Vector3d& centre_ct_mm);

}  // namespace raylign::detail

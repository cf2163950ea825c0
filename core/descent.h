#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/optimize/levenberg_marquardt.h"
#include "core/optimize/step.h"
#include "raylign/rigid_transform.h"
#include "raylign/similarity.h"
#include "raylign/termination.h"

namespace raylign::detail {

/// Where a search over poses begins, and what is known there: its views linearized, or nothing.
struct DescentStart {
    RigidTransform world_from_ct;
    std::vector<Linearization> views{};
};

/// Levenberg-Marquardt over poses, as in LevenbergMarquardtSearch. Parameters are those of PoseSpace around the pose
/// reached: turns about the point `centre_ct_mm` of the volume times `radius_mm`, and its shifts, all in mm at the rim.
struct DescentProblem {
    Eigen::Vector3d centre_ct_mm;
    double radius_mm = 1;
    LevenbergMarquardtOptions options;
    std::function<void()> before_batch;  ///< called now and then, before there is work to wait for; may throw to stop
    /// Called for accepted steps, in the order of each search; returns false to end that search. May be empty.
    std::function<bool(std::size_t search, const OptimizerStep&, const RigidTransform& world_from_ct)> on_step;
};

struct DescentEnd {
    RigidTransform world_from_ct;
    double cost = 0;
    std::vector<Linearization> views{};  ///< there
    int iterations = 0;                  ///< accepted steps
    int linearizations = 0;              ///< those of the search, not what was known at its start
    double last_length = 0;              ///< of the last step accepted; 0: none was
    Termination termination = Termination::converged;
    std::optional<RigidTransform> refused{};  ///< a pose that no rays can be made for
};

/// All that rays of one view need to follow the pose of the volume: see make_ray_frame.
struct DescentView {
    Eigen::Vector3d source_world_mm;
    Eigen::Matrix3d world_from_pixel;  ///< rotation of world_from_camera times the inverse intrinsics
    double depth_max_mm, ceiling;      ///< as in RayFrame
    double share;                      ///< in the cost
};

}  // namespace raylign::detail

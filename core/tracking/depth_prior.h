#pragma once

#include <Eigen/Core>

#include "raylign/result.h"

namespace raylign::detail {

/// What is known of an object's depth beside the image: along a view's line of sight, from the frame before.
struct DepthPrior {
    Eigen::Vector3d axis_world = Eigen::Vector3d::UnitZ();  ///< line of sight, unit
    double ahead_mm = 0;                                    ///< where it lies, from the pose found, along the axis
    double sigma_mm = 1;                                    ///< how sure that is; positive
};

/// An object found at `found_mm` lies as deep as `before_mm`, along the ray from the source to where it was found.
[[nodiscard]] DepthPrior depth_like(const Eigen::Vector3d& before_mm, double sigma_mm, const Eigen::Vector3d& found_mm,
                                    const Eigen::Vector3d& source_mm);

/// Joins pose and prior, both by their covariances (one Kalman update [Barfoot17, section 4.2.3]): with d = (0, axis)
/// and gain k = C d / (d^T C d + sigma^2) the pose is moved by the twist k ahead about the object's centre, and C
/// becomes C - k d^T C. What hangs together with depth (turns out of the plane, the place in it) moves along. Nothing
/// where the pose's covariance is not estimated, or where they contradict each other: more than three standard
/// deviations apart. True where joined. `centre_ct_mm`, `radius_mm`: of the object.
bool join_depth(RegistrationResult& result, const DepthPrior& prior, const Eigen::Vector3d& centre_ct_mm,
                double radius_mm);

}  // namespace raylign::detail

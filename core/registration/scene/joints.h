#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/optimize/levenberg_marquardt.h"
#include "core/registration/object/overlap.h"
#include "raylign/rigid_transform.h"

namespace raylign::detail {

/// How far two objects of a scene may have moved against each other since the CT: their volumes share its coordinates,
/// so that equal poses put them as they lie there.
struct JointLimit {
    std::size_t first = 0, second = 0;  ///< positions among the objects
    double apart_mm = 0;                ///< of the joint's centre, in (0, 100]
    double turned_deg = 0;              ///< in (0, 90]
};

/// A limit as a prior. It counts as the radius within which 95 of 100 joints stay: sigma = limit / sqrt(7.81) for each
/// of the three components of shift and turn.
struct JointPrior {
    JointLimit limit;
    Eigen::Vector3d centre_ct_mm = Eigen::Vector3d::Zero();  ///< where the two are nearest
    double sigma_mm = 1, sigma_rad = 1;
};

/// Throws Error where the objects lie farther apart than neighbours do: their volumes do not share coordinates, or no
/// joint is between them. `names`: of the objects.
[[nodiscard]] JointPrior make_joint_prior(const JointLimit& limit, const ObjectSample& first,
                                          const ObjectSample& second, std::span<const std::string> names);

/// How the second object has moved against the first since the CT.
struct JointMotion {
    Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();  ///< rotation vector, in world
    Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();  ///< of the joint's centre, in world
};
[[nodiscard]] JointMotion joint_motion(const JointPrior& joint, const RigidTransform& first_world_from_ct,
                                       const RigidTransform& second_world_from_ct);

/// The motion over its sigmas, turn first: six numbers that are standard normal where the prior is right, with their
/// derivatives by twists (rad, mm) of the two objects about points in world.
struct JointResidual {
    Twist residual;
    Eigen::Matrix<double, 6, 6> by_first, by_second;
};
[[nodiscard]] JointResidual joint_residual(const JointPrior& joint, const RigidTransform& first_world_from_ct,
                                           const RigidTransform& second_world_from_ct,
                                           const Eigen::Vector3d& first_centre_mm,
                                           const Eigen::Vector3d& second_centre_mm);

/// Minus the logarithm of all priors: sum |residual|^2 / 2.
[[nodiscard]] double joint_cost(std::span<const JointPrior> joints, std::span<const RigidTransform> world_from_ct);

/// A moving object's parameters in a model: where they begin, and what they are about.
struct JointEnd {
    Eigen::Index at = -1;  ///< -1: it does not move
    Eigen::Vector3d centre_world_mm = Eigen::Vector3d::Zero();
    double radius_mm = 1;
};

/// Adds `noise` times the priors to a model of the scene in PoseSpace parameters: cost, gradient J^T r, and J^T J in
/// the blocks of both objects. `ends`: one per object.
void add_joints(std::span<const JointPrior> joints, std::span<const RigidTransform> world_from_ct,
                std::span<const JointEnd> ends, double noise, LocalModel& model);

}  // namespace raylign::detail

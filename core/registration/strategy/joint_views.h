#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/backend.h"
#include "core/optimize/levenberg_marquardt.h"

namespace raylign::detail {

/// Object and cameras together. Camera v is moved in world by moved[v]: its view sees world as if all else were moved
/// by the inverse.
struct JointPose {
    RigidTransform world_from_ct;
    std::vector<RigidTransform> moved;
};

/// One view alone: its images in a session of its own, made with its camera moved by `session_moved` already.
struct JointView {
    std::unique_ptr<Session> session;
    RigidTransform session_moved;
    double noise = 1;   ///< what turns its cost into a negative log likelihood (ViewEvidence::noise)
    double share = 1;   ///< of its cost, 1 = as the others
    bool moves = true;  ///< false: its camera stays
};

/// The joint problem: with the cost C_v of each view at the object's twist x less the camera's y_v,
///   F(x, y) = sum_v share_v C_v(x - y_v) / noise_v + 1/2 sum_v (|w_v|^2 / prior_rad^2 + |u_v|^2 / prior_mm^2),
/// where w_v is the rotation vector of moved[v] and u_v its shift of `centre_world_mm`: a negative log posterior.
/// Twists are about that point.
struct JointProblem {
    std::vector<JointView> views;
    double prior_rad, prior_mm;
    Eigen::Vector3d centre_world_mm;
    double radius_mm;  ///< makes rotations lengths at the object's rim
    std::function<void()> before_batch;
};

/// The pose that a view's session must be asked for.
[[nodiscard]] RigidTransform pose_in_session(const JointPose& pose, const JointView& view, std::size_t index);

/// The camera's twist (rad, mm): rotation vector, and shift of the centre.
[[nodiscard]] Twist camera_twist(const RigidTransform& moved, const Eigen::Vector3d& centre_world_mm);

/// F with gradient and Gauss-Newton matrix, in (x, y of each camera that moves), rotations times radius_mm.
[[nodiscard]] LocalModel joint_model(const JointProblem& problem, const JointPose& pose);

/// The gradient in (x, y of each camera that moves; rad, mm) of a view that wants the object moved by `wanted` (rad,
/// mm, in its session's world, where its cost has this curvature).
[[nodiscard]] Eigen::VectorXd pull_of_view(const JointProblem& problem, const JointPose& pose, std::size_t view,
                                           const Eigen::Matrix<double, 6, 6>& curvature, const Twist& wanted);

/// The pose after a step in these parameters.
[[nodiscard]] JointPose stepped(const JointProblem& problem, const JointPose& pose, const Eigen::VectorXd& step);

/// What is left for the object once the cameras are eliminated: of a model's [A, B; B^T, D], A - B D^-1 B^T and the
/// gradient that belongs to it. With H_v, g_v of one view and P the prior's precision this is
/// sum_v [H_v - H_v (H_v + P)^-1 H_v] and sum_v [g_v - H_v (H_v + P)^-1 (g_v - P y_v)].
[[nodiscard]] LocalModel without_cameras(const LocalModel& model);

/// Levenberg-Marquardt from `pose`. Returns the outcome's model at the end, in `pose` where it ends.
[[nodiscard]] LevenbergMarquardtResult solve_jointly(const JointProblem& problem, JointPose& pose,
                                                     const LevenbergMarquardtOptions& options);

}  // namespace raylign::detail

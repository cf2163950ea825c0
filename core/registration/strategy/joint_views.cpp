#include "core/registration/strategy/joint_views.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/base/linear_algebra.h"

namespace raylign::detail {
namespace {

/// Where a view's camera stands among the parameters; none for one that stays.
std::optional<Eigen::Index> place_of(const JointProblem& problem, std::size_t view) {
    if (!problem.views[view].moves) return std::nullopt;
    Eigen::Index place = 6;
    for (std::size_t v = 0; v < view; ++v) place += problem.views[v].moves ? 6 : 0;
    return place;
}

Eigen::Index parameter_count(const JointProblem& problem) {
    return 6 + 6 * std::ranges::count_if(problem.views, [](const JointView& view) { return view.moves; });
}

/// Precision of a camera's twist under the prior.
Vector6 precision(const JointProblem& problem) {
    Vector6 precision = Vector6::Constant(std::pow(problem.prior_mm, -2));
    precision.head<3>().setConstant(std::pow(problem.prior_rad, -2));
    return precision;
}

/// What a twist of the object in world is in the session's world, where the same motion is turned.
Matrix6 session_from_world(const JointPose& pose, const JointView& view, std::size_t v) {
    const Eigen::Matrix3d rotation = (view.session_moved * inverse(pose.moved[v])).rotation;
    Matrix6 turned = Matrix6::Zero();
    turned.topLeftCorner<3, 3>() = turned.bottomRightCorner<3, 3>() = rotation;
    return turned;
}

/// The view's linearization with respect to the object's twist about the centre in world.
Linearization in_world(const JointProblem& problem, const JointPose& pose, std::size_t v) {
    const JointView& view = problem.views[v];
    const RigidTransform session_pose = pose_in_session(pose, view, v);
    const Eigen::Vector3d centre_ct_mm = inverse(pose.world_from_ct) * problem.centre_world_mm;
    Linearization at;
    view.session->linearize({&session_pose, 1}, centre_ct_mm, {&at, 1});
    const Matrix6 turned = session_from_world(pose, view, v);
    const double scale = view.share / view.noise;
    return {scale * at.cost, scale * turned.transpose() * at.gradient,
            scale * turned.transpose() * at.curvature * turned};
}

void add_view(const Linearization& at, std::optional<Eigen::Index> place, LocalModel& model) {
    model.cost += at.cost;
    model.gradient.head<6>() += at.gradient;
    model.curvature.topLeftCorner<6, 6>() += at.curvature;
    if (!place) return;
    model.gradient.segment<6>(*place) -= at.gradient;
    model.curvature.block<6, 6>(*place, *place) += at.curvature;
    model.curvature.block<6, 6>(0, *place) -= at.curvature;
    model.curvature.block<6, 6>(*place, 0) -= at.curvature;
}

}  // namespace

RigidTransform pose_in_session(const JointPose& pose, const JointView& view, std::size_t index) {
    return view.session_moved * inverse(pose.moved[index]) * pose.world_from_ct;
}

Twist camera_twist(const RigidTransform& moved, const Eigen::Vector3d& centre_world_mm) {
    Twist twist;
    twist << log(moved).head<3>(), moved * centre_world_mm - centre_world_mm;
    return twist;
}

LocalModel joint_model(const JointProblem& problem, const JointPose& pose) {
    problem.before_batch();
    const Eigen::Index n = parameter_count(problem);
    LocalModel model{0, Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Zero(n, n)};
    const Vector6 prior = precision(problem);
    for (std::size_t v = 0; v < problem.views.size(); ++v) {
        const std::optional<Eigen::Index> place = place_of(problem, v);
        add_view(in_world(problem, pose, v), place, model);
        if (!place) continue;
        // Exact, though the parameters are not added to the twist: rotation and shift of an isotropic prior change
        // along themselves as by a sum.
        const Twist twist = camera_twist(pose.moved[v], problem.centre_world_mm);
        model.cost += twist.dot(prior.cwiseProduct(twist)) / 2;
        model.gradient.segment<6>(*place) += prior.cwiseProduct(twist);
        model.curvature.diagonal().segment<6>(*place) += prior;
    }
    Eigen::VectorXd scale = Eigen::VectorXd::Ones(n);
    for (Eigen::Index i = 0; i < n; i += 6) scale.segment<3>(i) /= problem.radius_mm;
    model.gradient = scale.cwiseProduct(model.gradient).eval();
    model.curvature = (scale.asDiagonal() * model.curvature * scale.asDiagonal()).eval();
    return model;
}

Eigen::VectorXd pull_of_view(const JointProblem& problem, const JointPose& pose, std::size_t view,
                             const Matrix6& curvature, const Twist& wanted) {
    const JointView& v = problem.views[view];
    const Vector6 pull = -v.share / v.noise * session_from_world(pose, v, view).transpose() * curvature * wanted;
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(parameter_count(problem));
    gradient.head<6>() = pull;
    if (const std::optional<Eigen::Index> place = place_of(problem, view)) gradient.segment<6>(*place) = -pull;
    return gradient;
}

JointPose stepped(const JointProblem& problem, const JointPose& pose, const Eigen::VectorXd& step) {
    const auto moved_by = [&](Eigen::Index first) {
        Twist twist = step.segment<6>(first);
        twist.head<3>() /= problem.radius_mm;
        return exp_about(twist, problem.centre_world_mm);
    };
    JointPose result{moved_by(0) * pose.world_from_ct, pose.moved};
    for (std::size_t v = 0; v < problem.views.size(); ++v) {
        if (const std::optional<Eigen::Index> place = place_of(problem, v)) {
            result.moved[v] = moved_by(*place) * pose.moved[v];
        }
    }
    return result;
}

LocalModel without_cameras(const LocalModel& model) {
    const Eigen::Index cameras = model.gradient.size() - 6;
    LocalModel reduced{model.cost, model.gradient.head<6>(), model.curvature.topLeftCorner<6, 6>()};
    if (cameras == 0) return reduced;
    const Eigen::MatrixXd of_cameras = model.curvature.bottomRightCorner(cameras, cameras);
    const Eigen::MatrixXd between = model.curvature.bottomLeftCorner(cameras, 6);
    for (Eigen::Index i = 0; i < 6; ++i) {
        reduced.curvature.col(i) -= between.transpose() * solve_symmetric(of_cameras, Eigen::VectorXd(between.col(i)));
    }
    reduced.gradient -=
        between.transpose() * solve_symmetric(of_cameras, Eigen::VectorXd(model.gradient.tail(cameras)));
    return reduced;
}

LevenbergMarquardtResult solve_jointly(const JointProblem& problem, JointPose& pose,
                                       const LevenbergMarquardtOptions& options) {
    return levenberg_marquardt(
        {.linearize = [&](const Eigen::VectorXd& step) { return joint_model(problem, stepped(problem, pose, step)); },
         .accept = [&](const Eigen::VectorXd& step) { pose = stepped(problem, pose, step); },
         .dimension = static_cast<int>(parameter_count(problem))},
        options);
}

}  // namespace raylign::detail

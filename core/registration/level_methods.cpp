#include "core/registration/level_methods.h"

#include <algorithm>
#include <vector>

#include "core/optimize/levenberg_marquardt.h"
#include "core/optimize/steepest_descent.h"

namespace raylign {
namespace {

constexpr double kDifferenceStep_px =
    0.25;  // of a pixel at the object: small against the filter, large against float noise
constexpr double kMaxStep_px = 16;

/// d twist / d x of PoseSpace: parameters are millimetres at the rim.
Eigen::VectorXd twist_per_parameter(const ObjectExtent& extent) {
    Eigen::VectorXd scale = Eigen::VectorXd::Ones(6);
    scale.head<3>() /= extent.radius_mm;
    return scale;
}

}  // namespace

LevelOutcome run_steepest_descent(const LevelProblem& problem, const PoseCallback& on_step) {
    const PoseSpace space = make_pose_space(problem.start_world_from_ct, problem.extent);
    const BatchObjective objective = [&](std::span<const Eigen::VectorXd> points, std::span<double> costs) {
        std::vector<RigidTransform> poses;
        poses.reserve(points.size());
        for (const Eigen::VectorXd& x : points) poses.push_back(space.pose(x));
        problem.before_batch();
        problem.session.evaluate(poses, costs);
    };
    LevelOutcome outcome;
    outcome.last_step_mm = problem.initial_step_mm;
    const auto step = [&](const OptimizerStep& s, const Eigen::VectorXd& x) {
        outcome.last_step_mm = s.length;
        return on_step(s, space.pose(x));
    };
    const SteepestDescentResult found =
        steepest_descent(objective, Eigen::VectorXd::Zero(6),
                         {.difference_step = kDifferenceStep_px * problem.pixel_at_object_mm,
                          .initial_step = problem.initial_step_mm,
                          .max_step = std::max(kMaxStep_px * problem.pixel_at_object_mm, problem.initial_step_mm),
                          .step_tolerance = problem.step_tolerance_mm,
                          .max_iterations = problem.max_iterations},
                         step);
    outcome.world_from_ct = space.pose(found.point);
    outcome.cost = found.cost;
    outcome.iterations = found.iterations;
    outcome.termination = found.termination;
    return outcome;
}

LevelOutcome run_gauss_newton(const LevelProblem& problem, const PoseCallback& on_step) {
    RigidTransform base = problem.start_world_from_ct;
    const Eigen::VectorXd scale = twist_per_parameter(problem.extent);
    const auto pose = [&](const Eigen::VectorXd& x) { return make_pose_space(base, problem.extent).pose(x); };
    const ManifoldProblem manifold{
        .linearize =
            [&](const Eigen::VectorXd& x) {
                const RigidTransform world_from_ct = pose(x);
                Linearization at;
                problem.before_batch();
                problem.session.linearize({&world_from_ct, 1}, problem.extent.centre_ct_mm, {&at, 1});
                return LocalModel{at.cost, scale.cwiseProduct(Eigen::VectorXd(at.gradient)),
                                  scale.asDiagonal() * at.curvature * scale.asDiagonal()};
            },
        .accept = [&](const Eigen::VectorXd& x) { base = pose(x); }};
    LevelOutcome outcome;
    outcome.last_step_mm = problem.initial_step_mm;
    const auto step = [&](const OptimizerStep& s) {
        outcome.last_step_mm = s.length;
        return on_step(s, base);
    };
    const LevenbergMarquardtResult found = levenberg_marquardt(manifold,
                                                               {.max_step = kMaxStep_px * problem.pixel_at_object_mm,
                                                                .step_tolerance = problem.step_tolerance_mm,
                                                                .max_iterations = problem.max_iterations},
                                                               step);
    outcome.world_from_ct = base;
    outcome.cost = found.model.cost;
    outcome.iterations = found.iterations;
    outcome.termination = found.termination;
    return outcome;
}

}  // namespace raylign

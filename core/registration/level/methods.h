#pragma once

#include <functional>
#include <span>
#include <vector>

#include "core/backend.h"
#include "core/optimize/step.h"
#include "core/registration/object/pose_space.h"
#include "raylign/options.h"
#include "raylign/termination.h"

namespace raylign::detail {

/// What a method needs to know of one level.
struct LevelProblem {
    Session& session;
    RigidTransform start_world_from_ct;
    ObjectExtent extent;        ///< rotation centre and scale
    double pixel_at_object_mm;  ///< the level's unit of length
    double initial_step_mm;
    double step_tolerance_mm;
    double cost_tolerance;  ///< gauss-newton also ends where its model promises less
    int max_iterations;
    std::function<void()> before_batch;     ///< called before the backend works; may throw to stop
    bool learns = false;                    ///< gauss-newton: see LevenbergMarquardtOptions
    std::vector<Linearization> at_start{};  ///< gauss-newton: views linearized at the start already; empty: not yet
};

struct LevelOutcome {
    RigidTransform world_from_ct;
    double cost = 0;
    std::vector<Linearization> views{};  ///< gauss-newton: there; else empty
    int iterations = 0;
    double last_step_mm = 0;
    Termination termination = Termination::converged;
};

/// The sum of a pose's views, each with its share in the cost.
[[nodiscard]] Linearization sum_of_views(const Session& session, std::span<const Linearization> views);

/// Called after each accepted step with its pose; returns false to stop.
using PoseCallback = std::function<bool(const OptimizerStep&, const RigidTransform& world_from_ct)>;

/// The method by name; automatic is not one.
[[nodiscard]] LevelOutcome run_method(Method method, const LevelProblem& problem, const PoseCallback& on_step);

[[nodiscard]] LevelOutcome run_steepest_descent(const LevelProblem& problem, const PoseCallback& on_step);
/// Levenberg-Marquardt on the manifold, from Session::linearize.
[[nodiscard]] LevelOutcome run_gauss_newton(const LevelProblem& problem, const PoseCallback& on_step);
[[nodiscard]] LevelOutcome run_bobyqa(const LevelProblem& problem, const PoseCallback& on_step);

/// Levenberg-Marquardt from many starts at once, one batch of linearizations per round for all that still move: what a
/// multi-start search lives on. Each ends exactly where run_gauss_newton would end from its start.
[[nodiscard]] std::vector<LevelOutcome> run_gauss_newton_batch(const LevelProblem& problem,
                                                               std::span<const RigidTransform> starts);

}  // namespace raylign::detail

#include "core/registration/level/methods.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/descent.h"
#include "core/optimize/bobyqa.h"
#include "core/optimize/levenberg_marquardt.h"
#include "core/optimize/steepest_descent.h"

namespace raylign::detail {
namespace {

// Of a pixel at the object: small against the filter, large against float noise.
constexpr double kDifferenceStep_px = 0.25;
constexpr double kMaxStep_px = 16;
constexpr int kBobyqaEvaluations = 13;  // per iteration of the limit: what a step of the other methods costs

/// d twist / d x of PoseSpace: parameters are millimetres at the rim.
Eigen::VectorXd twist_per_parameter(const ObjectExtent& extent) {
    Eigen::VectorXd scale = Eigen::VectorXd::Ones(6);
    scale.head<3>() /= extent.radius_mm;
    return scale;
}

BatchObjective objective_of(const LevelProblem& problem, const PoseSpace& space) {
    return [&problem, space](std::span<const Eigen::VectorXd> points, std::span<double> costs) {
        std::vector<RigidTransform> poses;
        poses.reserve(points.size());
        for (const Eigen::VectorXd& x : points) poses.push_back(space.pose(x));
        problem.before_batch();
        problem.session.evaluate(poses, costs);
    };
}

}  // namespace

LevelOutcome run_steepest_descent(const LevelProblem& problem, const PoseCallback& on_step) {
    const PoseSpace space = make_pose_space(problem.start_world_from_ct, problem.extent);
    const BatchObjective objective = objective_of(problem, space);
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

LevelOutcome run_bobyqa(const LevelProblem& problem, const PoseCallback& on_step) {
    const PoseSpace space = make_pose_space(problem.start_world_from_ct, problem.extent);
    LevelOutcome outcome;
    outcome.last_step_mm = problem.initial_step_mm;
    const auto step = [&](const OptimizerStep& s, const Eigen::VectorXd& x) {
        outcome.last_step_mm = s.length;
        return on_step(s, space.pose(x));
    };
    const BobyqaResult found = bobyqa(objective_of(problem, space), Eigen::VectorXd::Zero(6),
                                      {.initial_step = std::max(problem.initial_step_mm, problem.pixel_at_object_mm),
                                       .step_tolerance = problem.step_tolerance_mm,
                                       .max_evaluations = kBobyqaEvaluations * problem.max_iterations},
                                      step);
    outcome.world_from_ct = space.pose(found.point);
    outcome.cost = found.cost;
    outcome.iterations = found.iterations;
    outcome.termination = found.termination;
    return outcome;
}

namespace {

LevenbergMarquardtOptions gauss_newton_options(const LevelProblem& problem) {
    return {.max_step = kMaxStep_px * problem.pixel_at_object_mm,
            .step_tolerance = problem.step_tolerance_mm,
            .decrease_tolerance = problem.cost_tolerance,
            .max_iterations = problem.max_iterations,
            .learns = problem.learns};
}

/// One search on the manifold of poses: parameters are millimetres at the rim, around a base that moves.
struct PoseSearch {
    RigidTransform base;
    std::optional<LevenbergMarquardtSearch> search{};  ///< once the base is linearized
    std::vector<Linearization> views{};                ///< at the base, then

    [[nodiscard]] RigidTransform next(const ObjectExtent& extent) const {
        return search ? make_pose_space(base, extent).pose(search->step()) : base;
    }
    /// True if the base moved.
    bool take(std::vector<Linearization> there, const RigidTransform& pose, const LevelProblem& problem) {
        const Linearization at = sum_of_views(problem.session, there);
        const Eigen::VectorXd scale = twist_per_parameter(problem.extent);
        LocalModel model{at.cost, scale.cwiseProduct(Eigen::VectorXd(at.gradient)),
                         scale.asDiagonal() * at.curvature * scale.asDiagonal()};
        if (!search) {
            search.emplace(std::move(model), gauss_newton_options(problem));
            views = std::move(there);
            return false;
        }
        if (!search->take(std::move(model))) return false;
        base = pose;
        views = std::move(there);
        return true;
    }
    [[nodiscard]] bool done() const { return search && search->done(); }
    [[nodiscard]] LevelOutcome outcome(const LevelProblem& problem) const {
        const LevenbergMarquardtResult& found = search->result();
        return {.world_from_ct = base,
                .cost = found.model.cost,
                .views = views,
                .iterations = found.iterations,
                .last_step_mm = search->last_length() > 0 ? search->last_length() : problem.initial_step_mm,
                .termination = found.termination};
    }
};

/// Linearizes all searches that still move in one batch until none does. `on_step` may be empty.
void run_searches(std::vector<PoseSearch>& searches, const LevelProblem& problem, const PoseCallback& on_step) {
    for (;;) {
        std::vector<PoseSearch*> moving;
        std::vector<RigidTransform> poses;
        for (PoseSearch& s : searches) {
            if (s.done()) continue;
            moving.push_back(&s);
            poses.push_back(s.next(problem.extent));
        }
        if (moving.empty()) return;
        const std::size_t views = problem.session.view_count();
        std::vector<Linearization> at(poses.size() * views);
        problem.before_batch();
        problem.session.linearize_views(poses, problem.extent.centre_ct_mm, at);
        for (std::size_t i = 0; i < moving.size(); ++i) {
            const auto first = at.begin() + static_cast<std::ptrdiff_t>(i * views);
            std::vector<Linearization> there(first, first + static_cast<std::ptrdiff_t>(views));
            if (!moving[i]->take(std::move(there), poses[i], problem) || !on_step) continue;
            const LevenbergMarquardtSearch& search = *moving[i]->search;
            const LevenbergMarquardtResult& now = search.result();
            if (!on_step({now.iterations, now.model.cost, search.last_length()}, poses[i])) {
                moving[i]->search->stop(Termination::stopped);
            }
        }
    }
}

/// The same by the backend itself, where it can.
std::optional<std::vector<LevelOutcome>> descended(const LevelProblem& problem, std::span<const DescentStart> starts,
                                                   const PoseCallback& on_step) {
    DescentProblem descent{.centre_ct_mm = problem.extent.centre_ct_mm,
                           .radius_mm = problem.extent.radius_mm,
                           .options = gauss_newton_options(problem),
                           .before_batch = problem.before_batch,
                           .on_step = {}};
    if (on_step) {
        descent.on_step = [&](std::size_t, const OptimizerStep& step, const RigidTransform& pose) {
            return on_step(step, pose);
        };
    }
    std::optional<std::vector<DescentEnd>> ends = problem.session.descend(descent, starts);
    if (!ends) return std::nullopt;
    std::vector<LevelOutcome> outcomes;
    for (DescentEnd& end : *ends) {
        outcomes.push_back({.world_from_ct = end.world_from_ct,
                            .cost = end.cost,
                            .views = std::move(end.views),
                            .iterations = end.iterations,
                            .last_step_mm = end.last_length > 0 ? end.last_length : problem.initial_step_mm,
                            .termination = end.termination});
    }
    return outcomes;
}

}  // namespace

Linearization sum_of_views(const Session& session, std::span<const Linearization> views) {
    Linearization sum;
    for (std::size_t v = 0; v < views.size(); ++v) {
        const double share = session.view_share(v);
        sum += {share * views[v].cost, share * views[v].gradient, share * views[v].curvature};
    }
    return sum;
}

namespace {

std::vector<LevelOutcome> run_from(const LevelProblem& problem, std::span<const DescentStart> starts,
                                   const PoseCallback& on_step) {
    if (auto ends = descended(problem, starts, on_step)) return std::move(*ends);
    std::vector<PoseSearch> searches;
    for (const DescentStart& start : starts) {
        PoseSearch& search = searches.emplace_back(PoseSearch{.base = start.world_from_ct});
        if (!start.views.empty()) search.take(start.views, start.world_from_ct, problem);
    }
    run_searches(searches, problem, on_step);
    std::vector<LevelOutcome> outcomes;
    for (const PoseSearch& s : searches) outcomes.push_back(s.outcome(problem));
    return outcomes;
}

}  // namespace

LevelOutcome run_gauss_newton(const LevelProblem& problem, const PoseCallback& on_step) {
    const DescentStart start{problem.start_world_from_ct, problem.at_start};
    return std::move(run_from(problem, {&start, 1}, on_step).front());
}

std::vector<LevelOutcome> run_gauss_newton_batch(const LevelProblem& problem, std::span<const RigidTransform> starts) {
    std::vector<DescentStart> all;
    for (const RigidTransform& start : starts) all.push_back({start});
    return run_from(problem, all, {});
}

LevelOutcome run_method(Method method, const LevelProblem& problem, const PoseCallback& on_step) {
    switch (method) {
        case Method::gauss_newton:
            return run_gauss_newton(problem, on_step);
        case Method::bobyqa:
            return run_bobyqa(problem, on_step);
        case Method::steepest_descent:
            return run_steepest_descent(problem, on_step);
        case Method::automatic:
            break;
    }
    throw Error("run_method: automatic is not a method of its own");
}

}  // namespace raylign::detail

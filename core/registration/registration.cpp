#include "core/registration/registration.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "core/image/pyramid.h"
#include "core/registration/level_methods.h"
#include "core/registration/levels.h"
#include "core/registration/pose_space.h"

namespace raylign {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

constexpr double kInitialStep_px = 2;         // on the coarsest level; finer ones start where the coarser one ended
constexpr double kToleranceFinest_px = 5e-4;  // far below the 0.01 mm that engines must agree on
constexpr double kToleranceCoarse_px = 2e-2;  // the next level corrects the rest
constexpr double kWeakCost = 0.5;        // a mean correlation below one half: the DRR explains too little to be sure
constexpr double kTestedShift_mm = 60;   // how far starts have been tested (bench/README.md)
constexpr double kTestedTurn_rad = 0.8;  // 45 degrees
constexpr int kTypicalIterations = 15;   // per level: scales the progress estimate only

double engine_seconds(const SessionTiming& t) {
    return t.prepare_s + t.drr_s + t.gradient_s + t.reduction_s + t.transfer_s;
}

void add(SessionTiming& sum, const SessionTiming& t) {
    sum.prepare_s += t.prepare_s;
    sum.drr_s += t.drr_s;
    sum.gradient_s += t.gradient_s;
    sum.reduction_s += t.reduction_s;
    sum.transfer_s += t.transfer_s;
}

void check(const RegistrationOptions& options, const RigidTransform& start) {
    if (options.levels < 0 || options.levels > 8) {
        throw bad_value("levels", std::to_string(options.levels), "in [1, 8], or 0 for as many as fit");
    }
    if (options.max_iterations_per_level < 1 || options.max_iterations_per_level > 10000) {
        throw bad_value("max_iterations_per_level", std::to_string(options.max_iterations_per_level), "in [1, 10000]");
    }
    if (!is_finite(start)) throw Error("start pose: must have finite numbers only");
}

/// The scene of one level. Owns the halved copies; the full volume is borrowed.
struct LevelScene {
    LevelScene(const Volume& full, std::span<const View> full_views, const LevelPlan& plan) : full_volume(full) {
        for (int i = 0; i < plan.volume_halvings; ++i) halved = half_resolution(i == 0 ? full : halved);
        is_halved = plan.volume_halvings > 0;
        for (std::size_t v = 0; v < full_views.size(); ++v) {
            views.push_back(full_views[v]);
            for (int i = 0; i < plan.image_halvings[v]; ++i) views.back() = half_resolution(views.back());
        }
    }
    [[nodiscard]] const Volume& volume() const { return is_halved ? halved : full_volume; }

    const Volume& full_volume;
    Volume halved;
    bool is_halved = false;
    std::vector<View> views;
};

class Driver {
public:
    Driver(const Volume& volume, std::span<const View> views, const RegistrationOptions& options, Backend& backend,
           const ProgressCallback& progress)
        : volume_(volume),
          views_(views),
          options_(options),
          backend_(backend),
          progress_(progress),
          extent_(object_extent(volume)) {
        if (!options.rotation_centre_ct_mm) return;
        // About another centre the rim is farther away: the mean squared distance grows by that of the centres.
        const double apart_mm = (*options.rotation_centre_ct_mm - extent_.centre_ct_mm).norm();
        extent_.radius_mm = std::sqrt(extent_.radius_mm * extent_.radius_mm + 5.0 / 3 * apart_mm * apart_mm);
        extent_.centre_ct_mm = *options.rotation_centre_ct_mm;
    }

    RegistrationResult run(const RigidTransform& start) {
        result_.world_from_ct = start;
        choose_method();
        const std::vector<LevelPlan> plan =
            plan_levels(volume_, views_, start, extent_, options_.similarity.filter, options_.levels);
        level_count_ = static_cast<int>(plan.size());
        for (const LevelPlan& level : plan) total_work_ += level_work(level);
        double step_mm = kInitialStep_px * plan.front().pixel_at_object_mm;
        for (std::size_t i = 0; i < plan.size(); ++i) {
            step_mm = run_level(plan[i], i + 1 == plan.size(), step_mm, start);
            done_work_ += level_work(plan[i]);
            if (result_.levels.back().termination == Termination::non_finite_cost) {
                result_.cost_final = std::numeric_limits<double>::quiet_NaN();
                break;
            }
        }
        result_.total_s = seconds_since(begin_);
        result_.optimizer_s = std::max(0.0, result_.total_s - engine_seconds(result_.timing));
        judge(start);
        return result_;
    }

private:
    void choose_method() {
        result_.method = options_.method;
        if (options_.method != Method::automatic) return;
        result_.method = Method::gauss_newton;
        result_.method_reason = "the fewest evaluations: the engine gives analytic derivatives";
    }

    [[nodiscard]] double level_work(const LevelPlan& level) const {
        // Halving images by 2 leaves a quarter of the rays; halving the volume, half of the samples on each.
        return std::exp2(-2.0 * level.image_halvings.front() - level.volume_halvings) * kTypicalIterations;
    }

    /// Runs one level from the pose so far and returns the length of its last step, for the next level's first.
    double run_level(const LevelPlan& plan, bool finest, double initial_step_mm, const RigidTransform& start) {
        const Clock::time_point begin = Clock::now();
        const LevelScene scene(volume_, views_, plan);
        const std::unique_ptr<Session> session =
            backend_.prepare({scene.volume(), scene.views, options_.render, {options_.similarity.metric, plan.filter}});
        if (result_.levels.empty()) check_overlap(*session, start);
        if (finest) session->evaluate({&start, 1}, {&result_.cost_initial, 1});

        LevelReport report = describe(plan, scene, *session);
        result_.levels.push_back(report);
        report.restarted = take_the_better_start(*session, start, report.cost_initial);
        const LevelOutcome found = optimize(plan, finest, initial_step_mm, *session);
        if (found.termination == Termination::stopped) throw Error("stopped by the caller", ErrorKind::cancelled);

        result_.world_from_ct = found.world_from_ct;
        report.cost_final = found.cost;
        report.iterations = found.iterations;
        report.termination = found.termination;
        if (finest) finish(*session);
        report.evaluations = session->counters().evaluations;
        report.linearizations = session->counters().linearizations;
        report.time_s = seconds_since(begin);
        result_.levels.back() = report;
        result_.iterations += found.iterations;
        result_.counters.evaluations += session->counters().evaluations;
        result_.counters.linearizations += session->counters().linearizations;
        result_.counters.bytes_to_host += session->counters().bytes_to_host;
        add(result_.timing, session->timing());
        return std::clamp(found.last_step_mm, plan.pixel_at_object_mm / 8, kInitialStep_px * plan.pixel_at_object_mm);
    }

    /// Sets the pose to begin a level with: the coarser level's result, unless the start costs less here (a coarse
    /// level may have gone astray). True if it is the start.
    bool take_the_better_start(Session& session, const RigidTransform& start, double& cost) {
        const std::array poses{result_.world_from_ct, start};
        std::array<double, 2> costs{};
        session.evaluate(poses, costs);
        const bool restart = result_.levels.size() > 1 && costs[1] < costs[0];
        if (restart) result_.world_from_ct = start;
        cost = costs[restart ? 1 : 0];
        return restart;
    }

    /// Costs of the result on the finest level, per view.
    void finish(Session& session) {
        const std::vector<MomentSums> sums = session.moment_sums({&result_.world_from_ct, 1});
        const auto channels = static_cast<std::size_t>(session.channel_count());
        result_.cost_final = 0;
        for (std::size_t v = 0; v < session.view_count(); ++v) {
            result_.view_costs.push_back(view_cost({sums.data() + v * channels, channels}));
            result_.cost_final += result_.view_costs.back() / static_cast<double>(session.view_count());
        }
    }

    [[nodiscard]] LevelOutcome optimize(const LevelPlan& plan, bool finest, double initial_step_mm, Session& session) {
        const LevelProblem problem{
            .session = session,
            .start_world_from_ct = result_.world_from_ct,
            .extent = extent_,
            .pixel_at_object_mm = plan.pixel_at_object_mm,
            .initial_step_mm = initial_step_mm,
            .step_tolerance_mm = (finest ? kToleranceFinest_px : kToleranceCoarse_px) * plan.pixel_at_object_mm,
            .max_iterations = options_.max_iterations_per_level,
            .before_batch = [&] {
                if (options_.cancelled && options_.cancelled())
                    throw Error("stopped by the caller", ErrorKind::cancelled);
            }};
        const auto on_step = [&](const OptimizerStep& step, const RigidTransform& pose) {
            return record(step, pose, plan);
        };
        return result_.method == Method::gauss_newton ? run_gauss_newton(problem, on_step)
                                                      : run_steepest_descent(problem, on_step);
    }

    [[nodiscard]] LevelReport describe(const LevelPlan& plan, const LevelScene& scene, const Session& session) const {
        LevelReport report;
        report.volume_size = scene.volume().grid.size;
        report.spacing_mm = scene.volume().grid.spacing_mm;
        for (const View& view : scene.views) report.image_sizes_px.push_back(view.geometry.camera.size_px);
        report.filter = plan.filter;
        report.volume_bytes = session.volume_bytes();
        return report;
    }

    bool record(const OptimizerStep& step, const RigidTransform& pose, const LevelPlan& plan) {
        const int level = static_cast<int>(result_.levels.size()) - 1;
        result_.history.push_back({level, step.iteration, step.cost, step.length, pose});
        if (!progress_) return true;
        const double share = std::min(1.0, static_cast<double>(step.iteration) / (kTypicalIterations + step.iteration));
        const double fraction = (done_work_ + share * level_work(plan)) / total_work_;
        const double elapsed_s = seconds_since(begin_);
        return progress_({.level = level,
                          .levels = level_count_,
                          .iteration = step.iteration,
                          .cost = step.cost,
                          .fraction = fraction,
                          .remaining_s = elapsed_s * (1 - fraction) / std::max(fraction, 1e-3)});
    }

    void check_overlap(Session& session, const RigidTransform& start) const {
        const std::vector<MomentSums> sums = session.moment_sums({&start, 1});
        const auto channels = static_cast<std::size_t>(session.channel_count());
        for (std::size_t v = 0; v < session.view_count(); ++v) {
            if (!std::all_of(sums.begin() + v * channels, sums.begin() + (v + 1) * channels, moving_is_constant))
                continue;
            throw Error("start pose: the DRR misses the detector of view " + views_[v].name +
                        " (nothing of the volume is projected onto its usable pixels)");
        }
    }

    void judge(const RigidTransform& start) {
        const LevelReport& last = result_.levels.back();
        std::vector<std::string>& reasons = result_.reasons;
        if (last.termination != Termination::converged) {
            reasons.push_back("level " + std::to_string(result_.levels.size()) + " ended by " +
                              std::string(termination_name(last.termination)) + " after " +
                              std::to_string(last.iterations) + " iterations");
        }
        for (std::size_t v = 0; v < result_.view_costs.size(); ++v) {
            if (result_.view_costs[v] < kWeakCost) continue;
            reasons.push_back("view " + views_[v].name + " correlates weakly with its DRR (cost " +
                              std::to_string(result_.view_costs[v]) + ", unrelated images have about 1)");
        }
        const RigidTransform moved = result_.world_from_ct * inverse(start);
        const Eigen::Vector3d centre_mm = start * extent_.centre_ct_mm;
        const double shift_mm = (moved * centre_mm - centre_mm).norm();
        if (shift_mm > kTestedShift_mm || rotation_angle_rad(moved) > kTestedTurn_rad) {
            reasons.push_back("the result is far from the start (" + std::to_string(shift_mm) + " mm, " +
                              std::to_string(rotation_angle_rad(moved) * 180 / std::numbers::pi) +
                              " deg): beyond the range in which the method has been tested");
        }
        if (!(result_.cost_final <= result_.cost_initial)) {
            reasons.push_back("the result's cost is not below the start's");
        }
        result_.ok = reasons.empty();
    }

    const Volume& volume_;
    std::span<const View> views_;
    const RegistrationOptions& options_;
    Backend& backend_;
    const ProgressCallback& progress_;
    ObjectExtent extent_;
    RegistrationResult result_;
    Clock::time_point begin_ = Clock::now();
    int level_count_ = 1;
    double total_work_ = 0, done_work_ = 0;
};

}  // namespace

std::string_view method_name(Method method) {
    switch (method) {
        case Method::automatic:
            return "auto";
        case Method::gauss_newton:
            return "gauss-newton";
        case Method::steepest_descent:
            return "steepest-descent";
    }
    return "unknown";
}

Method method_from_name(std::string_view name) {
    for (const Method method : {Method::automatic, Method::gauss_newton, Method::steepest_descent}) {
        if (name == method_name(method)) return method;
    }
    throw bad_value("method", name, "one of auto, gauss-newton, steepest-descent");
}

RegistrationResult register_volume(const Volume& volume, std::span<const View> views,
                                   const RigidTransform& start_world_from_ct, const RegistrationOptions& options,
                                   Backend& backend, const ProgressCallback& progress) {
    check(options, start_world_from_ct);
    check_scene({volume, views, options.render, options.similarity});
    return Driver(volume, views, options, backend, progress).run(start_world_from_ct);
}

}  // namespace raylign

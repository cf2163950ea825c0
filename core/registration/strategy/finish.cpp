#include "core/registration/strategy/finish.h"

#include <cmath>

#include "core/registration/level/pixel_weights.h"
#include "core/registration/policy.h"
#include "core/registration/strategy/coarse_to_fine.h"
#include "core/registration/strategy/contrast_fit.h"
#include "core/registration/strategy/domain.h"
#include "core/registration/strategy/views_alone.h"
#include "core/registration/trust/confidence.h"
#include "core/registration/trust/model_error.h"
#include "core/registration/trust/pose_sums.h"
#include "core/registration/trust/view_agreement.h"

namespace raylign::detail {
namespace {

constexpr int kRobustRounds = 3;
constexpr double kCutMagnification = 0.005;  // sigma of a cut CT's: right cameras showed up to 0.008
constexpr double kRobustSettled_px = 0.02;   // a renewal that moves the object's rim less is the last

/// Robust weights, renewed until they settle: the last ones alone. All but the last search need not end exactly: the
/// next renewal moves its end anyway.
std::vector<Image> make_robust(Run& run, Level& level, bool finest) {
    RegistrationResult& result = run.result;
    const double pixel_mm = level.plan().pixel_at_object_mm;
    PixelWeights weights(level.session());
    for (int round = 1; round <= kRobustRounds; ++round) {
        const RigidTransform before = result.world_from_ct;
        weights.reweight(before);
        ++result.robust_rounds;
        level.settle(false);
        const bool settled = apart_mm(before, result.world_from_ct, run.extent) < kRobustSettled_px * pixel_mm;
        if (settled || round == kRobustRounds) break;
    }
    if (finest) level.settle(true);
    return weights.robust();
}

}  // namespace

void explained_on(Run& run, Level& level) {
    run.explained_cost = level.report().cost_final;
    run.explained_view_costs = level.view_costs(run.result.world_from_ct);
}

namespace {

/// From the only view's source to the object's centre, in world.
Eigen::Vector3d line_of_sight_mm(const Run& run) {
    const Eigen::Vector3d centre_mm = run.result.world_from_ct * run.extent.centre_ct_mm;
    return centre_mm - source_world_mm(run.views.front().geometry);
}

std::vector<ViewSums> sums_at_the_pose(Run& run, Level& level, const SeventhDerivative& seventh = {},
                                       std::span<const Image> robust = {}) {
    const LevelProblem problem = level.problem(run.result.world_from_ct, false);
    return pose_sums(level.session(), run.result.world_from_ct, run.extent.centre_ct_mm, problem.before_batch, seventh,
                     robust);
}

/// What each view would like its camera to be against the others. `sums`: at the pose, on this level.
void compare_the_views(Run& run, Level& level, std::vector<ViewSums> sums, std::span<const double> shares,
                       const EvidenceScale& scale) {
    RegistrationResult& result = run.result;
    std::vector<Twist> moved;
    if (result.robust_rounds > 0 && run.options.similarity.metric == Metric::gc) {
        std::vector<ViewAlone> alone = views_alone(run, level, view_evidence(sums, scale));
        for (std::size_t v = 0; v < alone.size(); ++v) {
            moved.push_back(alone[v].moved);
            sums[v] = std::move(alone[v].sums);
        }
    }
    const std::vector<ViewCorrection> corrections =
        compare_views(sums, moved, shares, scale, run.extent.radius_mm, result.world_from_ct * run.extent.centre_ct_mm);
    for (std::size_t v = 0; v < corrections.size(); ++v) result.views[v].correction = corrections[v];
}

/// What one view cannot tell from depth where it shows an outline, and depth apart from all else.
void add_depth(Run& run) {
    const Eigen::Vector3d sight_mm = line_of_sight_mm(run);
    if (std::isfinite(run.views.front().ceiling)) {
        const ModelShift shift = size_shift(sight_mm);
        add_model_error(run.result.confidence, {&shift, 1}, run.extent.radius_mm);
    }
    split_by_depth(run.result.confidence, sight_mm.normalized());
}

constexpr double kLeftOfFit = 0.5;  // of what fitting the contrast moved may be left

/// How sure the pose of a part is. `robust`: its robust weights; `fitted`: by how much the pose was moved where the
/// contrast was fitted beside it.
void estimate_error_of_part(Run& run, Level& level, std::span<const Image> robust, const Twist& fitted) {
    Confidence& confidence = run.result.confidence;
    const std::vector<double> shares = shares_of(level.session());
    const std::vector<ViewSums> sums = sums_at_the_pose(run, level, {}, robust);
    const double radius_mm = run.extent.radius_mm;
    confidence = jackknife(sums, shares, radius_mm, kCalibration_part, true);
    add_model_error(confidence, model_shifts(sums, shares, run.result.cost_final), radius_mm);
    const ModelShift left{"contrast", kLeftOfFit, kLeftOfFit * fitted};
    add_model_error(confidence, {&left, 1}, radius_mm);
    if (run.views.size() == 1) add_depth(run);
}

/// How sure the pose of a whole is, and what each view would like its camera to be against the others. Both on the
/// coarser level, where there is one: its steps are what all pixels agree on.
void estimate_error_of_whole(Run& run, Level& level, Level* coarser, double calibration) {
    RegistrationResult& result = run.result;
    const std::vector<double> shares = shares_of(level.session());
    Level& steps = coarser ? *coarser : level;
    const bool compares = run.options.compare_views && run.views.size() > 1;
    const SeventhDerivative seventh = compares ? by_magnification(steps.views()) : SeventhDerivative{};
    const std::vector<ViewSums> coarse_sums = sums_at_the_pose(run, steps, seventh);
    const std::vector<ViewSums> sums = coarser ? sums_at_the_pose(run, level) : coarse_sums;
    result.confidence = jackknife(coarse_sums, shares, run.extent.radius_mm, calibration);
    add_model_error(result.confidence, model_shifts(sums, shares, result.cost_final), run.extent.radius_mm);
    if (run.views.size() == 1) add_depth(run);
    if (!compares) return;
    run.magnification = magnification(coarse_sums, shares, calibration);
    if (run.magnification && !run.shows_the_cut.value_or(true)) {
        run.magnification->sigma = std::hypot(run.magnification->sigma, kCutMagnification);
    }
    const EvidenceScale scale =
        evidence_scale(calibration, resolved_mm(level.plan().pixel_at_object_mm, level.report().spacing_mm));
    compare_the_views(run, steps, coarse_sums, shares, scale);
}

/// With one view depth is size, and size is told by the edges, which contrast that is compressed moves outwards.
Twist fitted_contrast(Run& run, Level& level) {
    const bool matters = run.views.size() == 1 && run.result.content == Content::part &&
                         run.result.method == Method::gauss_newton && !run.is_hopeless;
    return matters ? fit_contrast(run, level) : Twist::Zero();
}

/// What the finest level owes once its minimum is found: robust weights, costs, expected error.
void finish(Run& run, Level& level, Level* coarser) {
    RegistrationResult& result = run.result;
    const bool is_robust = wants_robust_weights(run, level);
    std::vector<Image> robust;
    if (is_robust) robust = make_robust(run, level, true);
    const Twist fitted = fitted_contrast(run, level);
    result.cost_initial = level.cost(run.start);
    result.fine_view_costs = level.view_costs(result.world_from_ct);
    // Noise alone raises the cost of a fine filter. A part is judged by the weights that tell it from its surroundings.
    const bool is_whole = result.content == Content::whole;
    result.view_costs = is_whole ? run.explained_view_costs : result.fine_view_costs;
    result.cost_final = level.report().cost_final;
    if (result.method != Method::gauss_newton) return;
    if (!is_whole) return estimate_error_of_part(run, level, robust, fitted);
    const double calibration = wants_robust_weights(run, level) ? kCalibration_mismatch : kCalibration_explained;
    estimate_error_of_whole(run, level, coarser, calibration);
}

void decide_fine_finish(Run& run, double cost) {
    run.result.decisions.push_back(
        "finished with a fine filter and evened-out gradients: the DRR leaves a part of the X-ray unexplained (cost " +
        std::to_string(cost) + ")");
}

/// From the result on a level of its own, evenly weighted.
void refine_finely(Run& run, Level& fine, bool is_last) {
    weigh_whole_evenly(run, fine, run.result.world_from_ct);
    fine.take_the_better_start(true);  // what lies over the object can lead an uneven descent away from a good start
    fine.settle(false);
    if (!is_last) (void)make_robust(run, fine, false);
}

LevelPlan finely_filtered(const Run& run, LevelPlan plan) {
    plan.filter = fine_filter(run);
    return plan;
}

}  // namespace

void take_for_hopeless(Run& run, bool is_hopeless) {
    constexpr const char* kDecision = "not refined: even the best place correlates with the X-ray by less than 0.05";
    std::erase(run.result.decisions, kDecision);
    if (is_hopeless) run.result.decisions.emplace_back(kDecision);
    run.is_hopeless = is_hopeless;
}

bool wants_robust_weights(const Run& run, const Level& level) {
    return run.options.robust && !run.is_hopeless && run.result.method == Method::gauss_newton &&
           level.report().cost_final >= kRobustFrom_cost;
}

bool wants_fine_finish(const Run& run, const Level& level) {
    return run.result.content == Content::whole && run.options.similarity.metric == Metric::gc &&
           wants_robust_weights(run, level);
}

void finish_as_it_needs(Run& run, Level& level, Level* coarser) {
    explained_on(run, level);
    if (!wants_fine_finish(run, level)) {
        finish(run, level, coarser);
        return;
    }
    decide_fine_finish(run, *run.explained_cost);
    ++run.level_count;
    on_level(run, finely_filtered(run, level.plan()), run.result.content, {}, [&](Level& fine) {
        refine_finely(run, fine, true);
        finish(run, fine, nullptr);
    });
}

void finish_near(Run& run, Level& level) {
    RegistrationResult& result = run.result;
    PixelWeights weights(level.session());
    if (wants_robust_weights(run, level)) {
        weights.reweight(result.world_from_ct);
        ++result.robust_rounds;
        level.settle(false);
    }
    const Twist fitted = fitted_contrast(run, level);
    result.cost_initial = level.cost(run.start);
    result.fine_view_costs = result.view_costs = level.view_costs(result.world_from_ct);
    result.cost_final = level.report().cost_final;
    estimate_error_of_part(run, level, weights.robust(), fitted);
}

void finish_finely(Run& run, const LevelPlan& coarser, const LevelPlan& last) {
    decide_fine_finish(run, run.explained_cost.value_or(run.result.cost_final));
    ++run.level_count;
    on_level(run, finely_filtered(run, coarser), run.result.content, {}, [&](Level& settling) {
        refine_finely(run, settling, false);
        on_level(run, finely_filtered(run, last), run.result.content, {}, [&](Level& fine) {
            refine_finely(run, fine, true);
            finish(run, fine, &settling);
        });
    });
}

}  // namespace raylign::detail

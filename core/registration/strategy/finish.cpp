#include "core/registration/strategy/finish.h"

#include "core/registration/level/pixel_weights.h"
#include "core/registration/policy.h"
#include "core/registration/strategy/coarse_to_fine.h"
#include "core/registration/trust/confidence.h"
#include "core/registration/trust/view_agreement.h"

namespace raylign::detail {
namespace {

constexpr double kRobustFrom_cost = 0.005;  // below, noise is all that is left: weights would only cost time
constexpr int kRobustRounds = 3;
constexpr double kRobustSettled_px = 0.02;  // a renewal that moves the object's rim less is the last

void make_robust(Run& run, Level& level) {
    if (!wants_robust_weights(run, level)) return;
    RegistrationResult& result = run.result;
    const double pixel_mm = level.plan().pixel_at_object_mm;
    PixelWeights weights(level.session());
    for (int round = 0; round < kRobustRounds; ++round) {
        const RigidTransform before = result.world_from_ct;
        weights.reweight(before);
        ++result.robust_rounds;
        level.optimize(before, true, pixel_mm);
        if (apart_mm(before, result.world_from_ct, run.extent) < kRobustSettled_px * pixel_mm) break;
    }
}

std::vector<double> costs_of_views(Session& session, const RigidTransform& world_from_ct) {
    const std::vector<MomentSums> sums = session.moment_sums({&world_from_ct, 1});
    const auto channels = static_cast<std::size_t>(session.channel_count());
    std::vector<double> costs;
    for (std::size_t v = 0; v < session.view_count(); ++v) {
        costs.push_back(view_cost({sums.data() + v * channels, channels}));
    }
    return costs;
}

/// What each view would like its camera to be, against the others.
void compare(Run& run, Level& level, const EvidenceScale& scale) {
    RegistrationResult& result = run.result;
    if (!run.options.compare_views || run.views.size() < 2) return;
    const LevelProblem problem = level.problem(result.world_from_ct, true);
    const std::vector<ViewCorrection> corrections = compare_views(problem, result.world_from_ct, scale);
    for (std::size_t v = 0; v < corrections.size(); ++v) result.views[v].correction = corrections[v];
}

/// What the finest level owes once its minimum is found: robust weights, costs, expected error.
void finish(Run& run, Level& level, Level* coarser) {
    RegistrationResult& result = run.result;
    make_robust(run, level);
    result.cost_initial = level.cost(run.start);
    result.view_costs = costs_of_views(level.session(), result.world_from_ct);
    result.cost_final = level.report().cost_final = level.cost(result.world_from_ct);
    if (result.method != Method::gauss_newton) return;
    const double calibration = wants_robust_weights(run, level) ? kCalibration_mismatch : kCalibration_explained;
    Level& used = coarser ? *coarser : level;
    result.confidence = jackknife(used.problem(result.world_from_ct, false), result.world_from_ct, calibration);
    compare(run, used, evidence_scale(calibration, level.plan().pixel_at_object_mm));
}

}  // namespace

bool wants_robust_weights(const Run& run, Level& level) {
    return run.options.robust && run.result.method == Method::gauss_newton &&
           level.report().cost_final >= kRobustFrom_cost;
}

void finish_as_it_needs(Run& run, Level& level, Level* coarser) {
    RegistrationResult& result = run.result;
    run.explained_cost = level.report().cost_final;
    const bool explains_all = result.content == Content::part || !wants_robust_weights(run, level);
    if (explains_all || run.options.similarity.metric != Metric::gc) {
        finish(run, level, coarser);
        return;
    }
    result.decisions.push_back(
        "finished with a fine filter and evened-out gradients: the DRR leaves a part of the X-ray unexplained (cost " +
        std::to_string(level.report().cost_final) + ")");
    LevelPlan plan = level.plan();
    plan.filter = fine_filter(run);
    ++run.level_count;
    on_level(run, plan, result.content, {}, [&](Level& fine) {
        fine.session().set_weights(local_normalisation(fine.session(), kNormalisation_mm / plan.pixel_at_object_mm));
        fine.report().cost_initial = fine.cost(result.world_from_ct);
        fine.optimize(result.world_from_ct, true, plan.pixel_at_object_mm);
        finish(run, fine, nullptr);
    });
}

}  // namespace raylign::detail

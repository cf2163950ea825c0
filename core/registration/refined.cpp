#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/registration/registration.h"
#include "core/registration/strategy/refine_views.h"
#include "core/registration/trust/confidence.h"
#include "core/registration/trust/verdict.h"

namespace raylign {
using namespace detail;
namespace {

void check_kept_view(const ViewPrior& prior, std::size_t views) {
    if (views < 2) {
        throw Error(
            "refine_views: one view cannot tell its camera's error from the object's pose: at least two are "
            "needed");
    }
    if (prior.kept_view && *prior.kept_view >= views) {
        throw bad_value("kept view", std::to_string(*prior.kept_view), "below " + std::to_string(views));
    }
}

template <class List>
void prepend(List& list, const List& before) {
    list.insert(list.begin(), before.begin(), before.end());
}

/// What came before belongs to the account of the whole run.
void account_for(RegistrationResult& result, const RegistrationResult& before) {
    const auto levels = static_cast<int>(before.levels.size());
    for (IterationRecord& record : result.history) record.level += levels;
    prepend(result.levels, before.levels);
    prepend(result.history, before.history);
    prepend(result.decisions, before.decisions);
    result.iterations += before.iterations;
    result.robust_rounds += before.robust_rounds;
    result.optimizer_s += before.optimizer_s;
    result.total_s += before.total_s;
    add_work(result, before);
}

/// With the cameras as given, and nothing said of them.
RegistrationOptions plain_options(const RegistrationOptions& options) {
    RegistrationOptions plain = options;
    plain.refine_views.reset();
    plain.compare_views = false;
    return plain;
}

constexpr double kRunawayPriors = 4;  // standard deviations of the prior: the camera is not the one that was meant

ViewCorrection applied(ViewCorrection correction, const ViewPrior& prior) {
    correction.is_applied = correction.is_estimated;
    const double turns = correction.rotation_deg.norm() / prior.rotation_deg;
    const double shifts = correction.translation_mm.norm() / prior.translation_mm;
    correction.is_doubtful = std::max(turns, shifts) > kRunawayPriors;
    return correction;
}

CameraFreedom freedom_of(const ViewPrior& prior, std::size_t views) {
    CameraFreedom freedom{std::vector<bool>(views, true), prior.rotation_deg, prior.translation_mm};
    if (prior.kept_view) freedom.moves[*prior.kept_view] = false;
    return freedom;
}

/// Once more from the pose that was found together with the cameras.
RegistrationResult register_with(ResidentVolume& volume, std::span<const View> moved, const RefinedViews& refined,
                                 const RegistrationResult& first, const RegistrationOptions& options,
                                 const RunControl& control) {
    RegistrationOptions again = plain_options(options);
    again.content = first.content;
    again.search = {.mode = Search::none};
    again.suspect_mirrored = false;
    RegistrationResult result = register_resident(volume, moved, refined.world_from_ct, again, control);
    if (result.confidence.is_estimated) {
        result.confidence.covariance += refined.covariance;  // what the cameras leave open beside what a DRR has not
        summarise(result.confidence, volume.extent().radius_mm);
    }
    for (std::size_t v = 0; v < moved.size(); ++v)
        result.views[v].correction = applied(refined.corrections[v], *options.refine_views);
    result.start_world_from_ct = first.start_world_from_ct;
    result.cost_initial = first.cost_initial;
    result.search = first.search;
    return result;
}

/// Neither the cameras nor the pose with them are known: what was found before, and why no more.
RegistrationResult not_refined(RegistrationResult first, const std::string& reason) {
    first.ok = false;
    first.reasons.insert(first.reasons.begin(), "the views' cameras were not refined: " + reason);
    return first;
}

}  // namespace

RegistrationResult detail::register_refined(ResidentVolume& volume, std::span<const View> views,
                                            const RigidTransform& start_world_from_ct,
                                            const RegistrationOptions& options, const RunControl& control) {
    check_kept_view(*options.refine_views, views.size());
    RegistrationResult first = register_resident(volume, views, start_world_from_ct, plain_options(options), control);
    if (first.termination == Termination::stopped || !std::isfinite(first.cost_final)) {
        return not_refined(std::move(first), "there is no finished pose to begin with");
    }
    ObjectExtent extent = volume.extent();
    extent.centre_ct_mm = first.rotation_centre_ct_mm;
    Run run{volume, views, options, control, extent, first.world_from_ct};
    run.result.method = first.method;
    std::optional<RefinedViews> refined;
    try {
        refined = refine_views(run, first, freedom_of(*options.refine_views, views.size()));
    } catch (const RunStopped&) {
        return not_refined(std::move(first), "stopped by the caller");
    }
    if (!refined) return not_refined(std::move(first), "too few pixels tell how sure each view is");
    run.result.total_s = run.elapsed_s();
    account_for(run.result, first);
    const std::vector<View> moved = with_moved_cameras(views, refined->moved);
    RegistrationResult result = register_with(volume, moved, *refined, first, options, control);
    account_for(result, run.result);
    result.reasons = doubts(result, moved, start_world_from_ct, extent);
    result.ok = result.reasons.empty();
    withhold_where_doubted(result);
    return result;
}

}  // namespace raylign

#include "core/registration/registration.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/image/transmission.h"
#include "core/registration/strategy/follow.h"
#include "core/registration/strategy/magnified.h"
#include "core/registration/strategy/refine_views.h"
#include "core/registration/strategy/reversed_contrast.h"
#include "core/registration/strategy/strategy.h"
#include "core/registration/trust/mirrored.h"
#include "core/registration/trust/verdict.h"
#include "core/registration/trust/view_agreement.h"

namespace raylign {
using namespace detail;
namespace {

constexpr double kParallelCosine = 0.985;  // 10 degrees

double backend_seconds(const SessionTiming& t) {
    return t.prepare_s + t.drr_s + t.gradient_s + t.reduction_s + t.transfer_s;
}

void check(const RegistrationOptions& options, const Backend& backend, const RigidTransform& start) {
    check_options(options, backend);
    if (!is_finite(start)) throw Error("start pose: must have finite numbers only");
}

ObjectExtent extent_about(ObjectExtent extent, const std::optional<Eigen::Vector3d>& centre_ct_mm) {
    if (!centre_ct_mm) return extent;
    // About another centre the rim is farther away: the mean squared distance grows by that of the centres.
    const double apart_mm = (*centre_ct_mm - extent.centre_ct_mm).norm();
    extent.radius_mm = std::sqrt(extent.radius_mm * extent.radius_mm + 5.0 / 3 * apart_mm * apart_mm);
    extent.centre_ct_mm = *centre_ct_mm;
    return extent;
}

/// Two views that look along one direction see no more depth than one.
void warn_of_parallel_views(std::span<const View> views, std::vector<std::string>& decisions) {
    const auto axis = [](const View& view) {
        return ray_direction_world(view.geometry, (view.geometry.camera.size_px.cast<double>().array() - 1) / 2);
    };
    for (std::size_t a = 0; a < views.size(); ++a) {
        for (std::size_t b = a + 1; b < views.size(); ++b) {
            if (std::abs(axis(views[a]).dot(axis(views[b]))) < kParallelCosine) continue;
            decisions.push_back("warning: views " + views[a].name + " and " + views[b].name +
                                " look along nearly the same direction: depth stays as weak as with one");
        }
    }
}

/// Searches; says why where that was ended early, with the best pose so far in the result.
template <class Search>
std::string ended_early(Run& run, const Search& search) {
    RegistrationResult& result = run.result;
    try {
        search();
        if (!result.levels.empty()) result.termination = result.levels.back().termination;
        return {};
    } catch (const RunStopped& stopped) {
        result.termination = stopped.why;
    }
    if (result.termination == Termination::stopped) return "stopped by the caller: the best pose so far";
    return "the time limit of " + number_text(run.options.time_limit_s.value_or(0)) +
           " s was over: the best pose so far";
}

/// Adds to the reasons where the images fit far better mirrored.
void suspect_mirrored(Run& run) {
    RegistrationOptions options = run.options;
    options.suspect_mirrored = false;
    options.compare_views = false;
    options.refine_views.reset();
    const auto cost_of = [&](std::span<const View> views) {
        try {
            if (run.control.stop.stop_requested()) return std::numeric_limits<double>::quiet_NaN();
            return register_resident(run.resident, views, run.start, options, run.control).cost_final;
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::input) throw;
            return std::numeric_limits<double>::quiet_NaN();
        }
    };
    if (const auto suspicion = mirror_suspicion(run.views, run.result, cost_of)) {
        run.result.reasons.push_back(*suspicion);
    }
}

/// Says what may be wrong with the images: what was suspected already, else what is found where `may_look` says so.
void name_suspicion(Run& run, bool may_look) {
    const bool is_weak = has_weak_view(run.result);
    const bool was_tried = run.result.content == Content::part;
    try {
        if (!run.suspicion && may_look && is_weak && !was_tried) run.suspicion = reversed_contrast(run);
    } catch (const RunStopped&) {
        return;  // the result stands; nobody waits for more reasons
    }
    if (run.suspicion) {
        run.result.reasons.insert(run.result.reasons.begin(), *run.suspicion);
    } else if (may_look) {
        suspect_mirrored(run);
    }
}

Run make_run(ResidentVolume& volume, std::span<const View> views, const RigidTransform& start,
             const RegistrationOptions& options, const RunControl& control) {
    Run run{volume, views, options, control, extent_about(volume.extent(), options.rotation_centre_ct_mm), start};
    run.result.start_world_from_ct = start;
    run.result.rotation_centre_ct_mm = run.extent.centre_ct_mm;
    run.result.metric = options.similarity.metric;
    for (const View& view : views) run.result.views.push_back({{}, view.geometry.camera_from_world});
    return run;
}

/// What is to be said of the pose once it is found. `stopped`: why the search was ended early; "" = it was not.
void judge(Run& run, const std::string& stopped) {
    RegistrationResult& result = run.result;
    result.total_s = run.elapsed_s();
    result.optimizer_s = std::max(0.0, result.total_s - backend_seconds(result.timing));
    for (const View& view : run.views) {
        result.overlap.push_back(seen_share(run.resident.sample(), view, result.world_from_ct));
        result.covered.push_back(covered_share(run.resident.sample(), view, result.world_from_ct));
    }
    judge_views(result, run.extent.radius_mm);
    result.reasons = doubts(result, run.views, run.start, run.extent);
    if (!run.shows_the_cut.value_or(true)) doubt_beyond_the_cut(result, result.reasons);
    if (const auto doubt = magnification_doubt(run.magnification))
        result.reasons.insert(result.reasons.begin(), *doubt);
    if (!stopped.empty()) result.reasons.insert(result.reasons.begin(), stopped);
    result.ok = result.reasons.empty() && !run.suspicion;
    withhold_where_doubted(result);
}

void check_prior(const RegistrationOptions& options, const Backend& backend) {
    if (!options.refine_views) return;
    const ViewPrior& prior = *options.refine_views;
    if (!(prior.rotation_deg > 0 && prior.rotation_deg <= 30)) {
        throw bad_value("view prior", number_text(prior.rotation_deg) + " degrees", "in (0, 30]");
    }
    if (!(prior.translation_mm > 0 && prior.translation_mm <= 200)) {
        throw bad_value("view prior", number_text(prior.translation_mm) + " mm", "in (0, 200]");
    }
    const bool is_newton = options.method == Method::automatic || options.method == Method::gauss_newton;
    if (!is_newton || !backend.info().has_derivatives) {
        throw Error("refine_views: needs gauss-newton, and a backend with derivatives (cpu, gl or reference)");
    }
    if (options.time_limit_s) throw Error("refine_views: registers several times, leave the time limit out");
}

}  // namespace

void detail::check_options(const RegistrationOptions& options, const Backend& backend) {
    const auto in_range = [](const char* what, std::optional<double> value, double low, double high,
                             const char* allowed) {
        if (value && !(*value >= low && *value <= high)) throw bad_value(what, number_text(*value), allowed);
    };
    const auto positive = [](const char* what, std::optional<double> value, double high, const char* allowed) {
        if (value && !(*value > 0 && *value <= high)) throw bad_value(what, number_text(*value), allowed);
    };
    in_range("levels", options.levels, 1, 8, "in [1, 8]");
    in_range("max_iterations_per_level", options.max_iterations_per_level, 1, 10000, "in [1, 10000]");
    positive("search range", options.search.range_mm, 500, "in (0, 500] mm");
    positive("search range", options.search.range_deg, 180, "in (0, 180] degrees");
    in_range("search starts", options.search.starts, 1, 1000000, "in [1, 1000000]");
    positive("time limit", options.time_limit_s, 1e9, "positive");
    check_prior(options, backend);
    const Search search = options.search.mode;
    if ((search == Search::near || search == Search::global) && !backend.info().has_derivatives) {
        throw Error("search: needs a backend with derivatives (cpu, gl or reference)");
    }
}

RegistrationResult register_volume(const Volume& volume, std::span<const View> views,
                                   const RigidTransform& start_world_from_ct, const RegistrationOptions& options,
                                   Backend& backend, const RunControl& control) {
    check(options, backend, start_world_from_ct);
    ResidentVolume resident(volume, options.render, backend);
    return register_resident(resident, views, start_world_from_ct, options, control);
}

RegistrationResult detail::register_resident(ResidentVolume& volume, std::span<const View> views,
                                             const RigidTransform& start_world_from_ct,
                                             const RegistrationOptions& options, const RunControl& control) {
    check(options, volume.backend(), start_world_from_ct);
    check_views(views);
    if (std::ranges::any_of(views, &View::by_transmission)) {
        return register_resident(volume, as_compared(views), start_world_from_ct, options, control);
    }
    if (options.refine_views) return register_refined(volume, views, start_world_from_ct, options, control);
    if (options.render.projector != volume.render().projector || options.render.step_mm != volume.render().step_mm) {
        throw Error("render settings: must be those that the volume was made resident with");
    }
    Run run = make_run(volume, views, start_world_from_ct, options, control);
    warn_of_parallel_views(views, run.result.decisions);
    const std::string stopped = ended_early(run, [&] {
        find_pose(run);
        look_for_magnification(run);
        if (!magnification_doubt(run.magnification)) look_closer(run, run.result);  // else all cameras are wrong
    });
    judge(run, stopped);
    const bool may_look = stopped.empty() && options.suspect_mirrored && !options.time_limit_s;
    if (!run.result.ok) name_suspicion(run, may_look);
    return std::move(run.result);
}

RegistrationResult detail::follow_resident(ResidentVolume& volume, std::span<const View> views,
                                           const RigidTransform& prediction_world_from_ct,
                                           const RegistrationOptions& options, int coarser_by,
                                           const RunControl& control) {
    check(options, volume.backend(), prediction_world_from_ct);
    check_views(views);
    if (std::ranges::any_of(views, &View::by_transmission)) {
        return follow_resident(volume, as_compared(views), prediction_world_from_ct, options, coarser_by, control);
    }
    Run run = make_run(volume, views, prediction_world_from_ct, options, control);
    judge(run, ended_early(run, [&] { follow(run, coarser_by); }));
    return std::move(run.result);
}

}  // namespace raylign

#include "core/registration/registration.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/error.h"
#include "core/registration/strategy/driver.h"
#include "core/registration/object/resident_volume.h"
#include "core/registration/trust/verdict.h"

namespace raylign {
namespace {

constexpr double kParallelCosine = 0.985;  // 10 degrees

double engine_seconds(const SessionTiming& t) {
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

}  // namespace

void check_options(const RegistrationOptions& options, const Backend& backend) {
    const auto in_range = [](const char* what, double value, double low, double high, const char* allowed) {
        if (!(value >= low && value <= high)) throw bad_value(what, std::to_string(value), allowed);
    };
    in_range("levels", options.levels, 0, 8, "in [1, 8], or 0 for as many as fit");
    in_range("max_iterations_per_level", options.max_iterations_per_level, 1, 10000, "in [1, 10000]");
    in_range("search range", options.search.range_mm, 0, 500, "in (0, 500] mm, or 0 for 20");
    in_range("search range", options.search.range_deg, 0, 180, "in (0, 180] degrees, or 0 for the default");
    in_range("search starts", options.search.starts, 0, 1000000, "in [1, 1000000], or 0 for the default");
    in_range("time limit", options.time_limit_s, 0, 1e9, "positive, or 0 for none");
    const Search search = options.search.mode;
    if ((search == Search::near || search == Search::global) && !backend.info().has_derivatives) {
        throw Error("search: needs an engine with derivatives (cpu, gl or reference)");
    }
}

RegistrationResult register_volume(const Volume& volume, std::span<const View> views,
                                   const RigidTransform& start_world_from_ct, const RegistrationOptions& options,
                                   Backend& backend, const ProgressCallback& progress) {
    check(options, backend, start_world_from_ct);
    ResidentVolume resident(volume, options.render, backend);
    return register_volume(resident, views, start_world_from_ct, options, progress);
}

RegistrationResult register_volume(ResidentVolume& volume, std::span<const View> views,
                                   const RigidTransform& start_world_from_ct, const RegistrationOptions& options,
                                   const ProgressCallback& progress) {
    check(options, volume.backend(), start_world_from_ct);
    check_views(views);
    if (options.render.projector != volume.render().projector || options.render.step_mm != volume.render().step_mm) {
        throw Error("render settings: must be those that the volume was made resident with");
    }
    RunContext run{volume,
                   volume.volume(),
                   views,
                   options,
                   volume.backend(),
                   progress,
                   extent_about(volume.extent(), options.rotation_centre_ct_mm),
                   volume.sample(),
                   start_world_from_ct};
    warn_of_parallel_views(views, run.result.decisions);
    bool timed_out = false;
    try {
        Driver(run).solve();
    } catch (const TimeIsUp&) {
        timed_out = true;
    }
    RegistrationResult& result = run.result;
    result.total_s = run.elapsed_s();
    result.optimizer_s = std::max(0.0, result.total_s - engine_seconds(result.timing));
    for (const View& view : views) {
        result.overlap.push_back(seen_share(run.sample, view, result.world_from_ct));
        result.covered.push_back(covered_share(run.sample, view, result.world_from_ct));
    }
    result.reasons = doubts(result, views, start_world_from_ct, run.extent);
    if (timed_out) {
        result.reasons.insert(result.reasons.begin(), "the time limit of " + std::to_string(options.time_limit_s) +
                                                          " s was over: the best pose so far");
    }
    result.ok = result.reasons.empty();
    return result;
}

}  // namespace raylign

#include "core/registration/strategy/reversed_contrast.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/registration/policy.h"
#include "core/registration/strategy/coarse_to_fine.h"

namespace raylign::detail {
namespace {

constexpr double kReversedFits = 0.4;     // cost on the coarsest level: unrelated edges do not come that low
constexpr double kReversedBetter = 0.15;  // of cost, as for mirrored images
constexpr double kFirstStep_px = 2;       // as a descent's on the coarsest level
constexpr std::size_t kMostSingleViews = 3;

std::vector<View> reversed(std::span<const View> views, std::optional<std::size_t> only) {
    std::vector<View> result(views.begin(), views.end());
    for (std::size_t v = 0; v < result.size(); ++v) {
        if (only && *only != v) continue;
        for (float& pixel : result[v].image.pixels) pixel = -pixel;
    }
    return result;
}

/// Cost at the end of a descent on the coarsest level; infinite where there is none.
double coarse_cost(const Run& run, std::span<const View> views) {
    const RunControl quiet{.on_progress = {}, .stop = run.control.stop, .meanwhile = run.control.meanwhile};
    Run trial{run.resident, views, run.options, quiet, run.extent, run.start};
    trial.result.method = run.result.method;
    trial.result.world_from_ct = run.start;
    trial.begin = run.begin;  // the time limit is the run's
    double cost = std::numeric_limits<double>::infinity();
    const std::vector<LevelPlan> levels = plan_run(trial, Content::whole);
    on_level(trial, levels.front(), Content::whole, std::nullopt, [&](Level& level) {
        cost = level.optimize(run.start, false, kFirstStep_px * level.plan().pixel_at_object_mm).cost;
    });
    return cost;
}

}  // namespace

std::optional<std::string> reversed_contrast(const Run& run) {
    if (run.result.levels.empty()) return std::nullopt;
    double best_cost = std::min(kReversedFits, run.result.levels.front().cost_final - kReversedBetter);
    std::string names;
    const std::size_t singles = run.views.size() > 1 && run.views.size() <= kMostSingleViews ? run.views.size() : 0;
    for (std::size_t trial = 0; trial <= singles; ++trial) {
        const auto only = trial > 0 ? std::optional(trial - 1) : std::nullopt;
        try {
            const double cost = coarse_cost(run, reversed(run.views, only));
            if (!(cost < best_cost)) continue;
            best_cost = cost;
            names = only ? "view " + run.views[*only].name : run.views.size() > 1 ? "all views" : "the view";
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::input) throw;
        }
    }
    if (names.empty()) return std::nullopt;
    return "with the contrast of " + names + " reversed the images fit far better (cost " + fixed(best_cost, 2) +
           " against " + fixed(run.result.levels.front().cost_final, 2) +
           " on the coarsest level): give the other \"polarity\" in views.json (bone-bright or bone-dark)";
}

}  // namespace raylign::detail

#include "core/registration/strategy/descent.h"

#include <algorithm>
#include <array>
#include <limits>

#include "core/registration/policy.h"
#include "core/registration/strategy/coarse_to_fine.h"
#include "core/registration/strategy/part_weights.h"

namespace raylign::detail {
namespace {

constexpr double kInitialStep_px = 2;  // on the coarsest level; finer ones start where the coarser one ended

/// Begins a level with the coarser level's result, unless the start costs less here (a coarse level may have gone
/// astray).
void take_the_better_start(Run& run, Level& level, const LevelPlace& place) {
    const std::array poses{run.result.world_from_ct, run.start};
    std::array<double, 2> costs{};
    level.session().evaluate(poses, costs);
    LevelReport& report = level.report();
    report.restarted = !place.is_first && costs[1] < costs[0];
    if (report.restarted) run.result.world_from_ct = run.start;
    report.cost_initial = costs[report.restarted ? 1 : 0];
}

/// True where the coarsest level of several already shows that a whole is a part.
bool is_hopeless(const Run& run, const LevelPlace& place, double cost) {
    return run.options.content == Content::automatic && run.result.content == Content::whole && place.is_first &&
           !place.is_last && cost > kHopelessCost;
}

}  // namespace

void descend(Run& run, Content content, StartCheck check) {
    RegistrationResult& result = run.result;
    const std::vector<LevelPlan> levels = plan_run(run, content);
    double step_mm = kInitialStep_px * levels.front().pixel_at_object_mm;
    const auto around_the_result = [&]() -> std::optional<Focus> {
        if (content == Content::whole) return std::nullopt;
        return Focus{result.world_from_ct, kDomainMargin_mm};
    };
    coarse_to_fine(run, content, levels, around_the_result, [&](Level& level, const LevelPlace& place) {
        if (place.is_first && check == StartCheck::overlap) level.check_overlap();
        if (content == Content::part) weigh_part(level, result.world_from_ct);
        take_the_better_start(run, level, place);
        const LevelOutcome found = level.optimize(result.world_from_ct, place.is_last, step_mm);
        const double pixel_mm = level.plan().pixel_at_object_mm;
        step_mm = std::clamp(found.last_step_mm, pixel_mm / 8, kInitialStep_px * pixel_mm);
        result.cost_final = found.cost;
        if (found.termination == Termination::non_finite_cost) {
            result.cost_final = std::numeric_limits<double>::quiet_NaN();
            return false;
        }
        return !is_hopeless(run, place, found.cost);
    });
}

}  // namespace raylign::detail

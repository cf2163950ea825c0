#include "core/registration/strategy/descent.h"

#include <algorithm>
#include <limits>

#include "core/registration/policy.h"
#include "core/registration/strategy/coarse_to_fine.h"
#include "core/registration/strategy/domain.h"
#include "core/registration/strategy/finish.h"

namespace raylign::detail {
namespace {

constexpr double kAsWellExplained = 0.15;  // of cost: what lies beyond a cut has 0.4 and more, 1 where it is unrelated
constexpr double kWellExplained = 0.05;    // cost on the coarsest level: nothing is missing
constexpr double kClearlyBetter = 0.5;     // times the cost: metal over the object brings less, a cut CT 0.03 to 0.4
constexpr double kInitialStep_px = 2;      // on the coarsest level; finer ones start where the coarser one ended

/// The X-ray ends where the CT does where the DRR explains what lies beyond the cut about as well as the rest.
bool ends_there(const CutCosts& costs) { return costs.beyond < costs.within + kAsWellExplained; }

/// On the coarsest level of a whole with cut sides: the descent has taken for granted that the X-ray ends where the CT
/// does. Where that explains it well, so it is. Else the start is descended from once more with the CT continued and
/// without what its cut sides hide, and that way is gone on with where it explains its own pixels clearly better.
LevelOutcome settle_the_cut(Run& run, Level& level, const LevelPlace& place, const LevelOutcome& whole,
                            double step_mm) {
    const CutCosts unknown{whole.cost, whole.cost};
    const CutCosts costs = costs_about_the_cut(run, level, whole.world_from_ct).value_or(unknown);
    run.shows_the_cut = !level.may_continue() || (whole.cost < kWellExplained && ends_there(costs));
    if (*run.shows_the_cut) return whole;
    level.go_beyond_the_cut(true);
    weigh_whole(run, level, run.start);
    const LevelOutcome more = level.optimize(run.start, place.is_last, step_mm);
    run.shows_the_cut = ends_there(costs) && more.cost > kClearlyBetter * costs.within;
    if (!*run.shows_the_cut) {
        run.result.decisions.push_back("the X-ray shows more than the CT: what its cut sides hide is left out");
        return more;
    }
    level.go_beyond_the_cut(false);
    run.result.world_from_ct = whole.world_from_ct;
    level.report().cost_final = whole.cost;
    return whole;
}

/// True where the coarsest level of several already shows that a whole is a part.
bool is_hopeless(const Run& run, const LevelPlace& place, double cost) {
    return run.options.content == Content::automatic && run.result.content == Content::whole && place.is_first &&
           !place.is_last && cost > kHopelessCost;
}

}  // namespace

void descend(Run& run, Content content, StartCheck check, std::ptrdiff_t left_out) {
    RegistrationResult& result = run.result;
    const std::vector<LevelPlan> levels = plan_run(run, content, left_out);
    double step_mm = kInitialStep_px * levels.front().pixel_at_object_mm;
    const auto around_the_result = [&]() -> std::optional<Focus> {
        if (content == Content::whole) return std::nullopt;
        return Focus{result.world_from_ct, kDomainMargin_mm};
    };
    coarse_to_fine(run, content, levels, around_the_result, [&](Level& level, LevelPlace place) {
        place.is_first = place.is_first && left_out == 0;
        if (place.is_first && check == StartCheck::overlap) level.check_overlap();
        if (content == Content::part) weigh_part(run, level, result.world_from_ct);
        if (content == Content::whole) weigh_whole(run, level, result.world_from_ct);
        level.take_the_better_start(!place.is_first);
        LevelOutcome found = level.optimize(result.world_from_ct, place.is_last, step_mm);
        if (content == Content::whole && place.is_first && !run.shows_the_cut) {
            found = settle_the_cut(run, level, place, found, step_mm);
        }
        take_for_hopeless(run, content == Content::part && found.cost > kHopelessCost_part);
        const double pixel_mm = level.plan().pixel_at_object_mm;
        step_mm = std::clamp(found.last_step_mm, pixel_mm / 8, kInitialStep_px * pixel_mm);
        result.cost_final = found.cost;
        if (found.termination == Termination::non_finite_cost) {
            result.cost_final = std::numeric_limits<double>::quiet_NaN();
            return Next::end;
        }
        if (is_hopeless(run, place, found.cost)) return Next::end;
        // The coarsest level only finds the place: of a short pyramid, weights must settle on the last.
        if (place.is_first || !place.is_last_but_one || !wants_fine_finish(run, level)) return Next::finer;
        explained_on(run, level);
        return Next::finely;
    });
}

}  // namespace raylign::detail

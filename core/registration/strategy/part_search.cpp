#include "core/registration/strategy/part_search.h"

#include <algorithm>
#include <numbers>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/registration/policy.h"
#include "core/registration/strategy/candidates.h"
#include "core/registration/strategy/coarse_to_fine.h"
#include "core/registration/strategy/domain.h"
#include "core/registration/strategy/finish.h"
#include "core/registration/strategy/judged.h"
#include "core/registration/strategy/template_search.h"

namespace raylign::detail {
namespace {

// A global search has more wrong places to tell from the right one: on a real wrist the template of the right pose
// ranked between 10th and 400th.
constexpr std::size_t kTemplates = 2048, kJudgedNear = 128, kJudgedGlobal = 768;
constexpr std::size_t kKeptParts = 24, kFewerParts = 16, kPartFinalists = 6;
constexpr int kFirstJudgement_iterations = 5;
constexpr double kHopelessMargin =
    0.15;                         // of cost, above the best: more than a finer level has been seen to make up for
constexpr double kAnyMargin = 2;  // the largest difference of costs
constexpr double kLeastTemplate_px = 5;  // of the object's thickness: a speck fits everywhere
constexpr double kMostReach_px = 60;     // at full resolution: 900,000 places an orientation

/// Of candidates in order at most `count`, none worse than the best by more than `margin`.
void keep_best(std::vector<Candidate>& candidates, std::size_t count, double margin) {
    if (candidates.size() > count) candidates.resize(count);
    std::erase_if(candidates, [least = candidates.empty() ? 0 : candidates.front().cost, margin](const Candidate& c) {
        return c.cost > least + margin;
    });
}

double range_mm(const Run& run) { return run.options.search.range_mm.value_or(kNearRange_mm); }

std::optional<Focus> focus_of(const Run& run, Search mode) {
    if (mode != Search::near) return std::nullopt;
    return Focus{run.start, range_mm(run) + kDomainMargin_mm};
}

/// The level that templates are moved over: everywhere in the field of view is much to look at, so half the resolution
/// of the coarsest level there, if the object's shape survives it.
LevelPlan template_plan(const Run& run, LevelPlan plan, Search mode) {
    const bool wide = mode != Search::near || range_mm(run) > kMostReach_px * plan.pixel_at_object_mm;
    if (!wide || run.extent.thickness_mm < 2 * kLeastTemplate_px * plan.pixel_at_object_mm) return plan;
    ++plan.volume_halvings;
    for (int& halvings : plan.image_halvings) ++halvings;
    plan.pixel_at_object_mm *= 2;
    return plan;
}

TemplateFits fits_on(Run& run, Level& level, Search mode) {
    const bool near = mode == Search::near;
    const double turn_deg = run.options.search.range_deg.value_or(near ? kNearTurn_deg : kGlobalTurn_deg);
    const TemplateRange range{.turn_rad = turn_deg * std::numbers::pi / 180,
                              .reach_mm = near ? range_mm(run) : 0,
                              .spacing_mm = level.plan().pixel_at_object_mm};
    return poses_by_templates(level.session(), level.views(), run.start, run.extent, range, kTemplates,
                              [&](double share) {
                                  stop_if_asked(run);
                                  show_progress(run, level.index(), share * level_work(level.plan()), 1);
                              });
}

std::vector<Candidate> template_candidates(Run& run, const LevelPlan& coarsest, Search mode) {
    const bool near = mode == Search::near;
    const LevelPlan plan = template_plan(run, coarsest, mode);
    ++run.level_count;
    run.total_work += level_work(plan);
    std::vector<Candidate> candidates;
    on_level(run, plan, Content::part, focus_of(run, mode), [&](Level& level) {
        if (near) level.check_overlap();
        TemplateFits fits = fits_on(run, level, mode);
        candidates =
            distinct(shown_enough(run, std::move(fits.best)), run.extent, kDistinct_px * plan.pixel_at_object_mm);
        keep_best(candidates, near ? kJudgedNear : kJudgedGlobal, kAnyMargin);
        run.result.search.starts = fits.tried;
        run.result.search.refined = static_cast<int>(candidates.size());
        run.done_work += level_work(plan);
        if (candidates.empty()) {
            throw Error(
                "search: no place " +
                (near ? "within " + fixed(range_mm(run), 0) + " mm of the start " : std::string()) +
                "where every view shows half of the object" +
                (near ? ": is the start right? A global search needs no more of it than a rough orientation" : ""));
        }
        level.report().cost_initial = level.report().cost_final = candidates.front().cost;
    });
    return candidates;
}

std::vector<Candidate> some(std::vector<Candidate> ends) {
    if (ends.empty()) throw Error("search: no refined pose has a finite cost");
    return ends;
}

}  // namespace

void search_part(Run& run, Search mode) {
    RegistrationResult& result = run.result;
    result.search.mode = mode;
    if (mode == Search::near) result.search.range_mm = range_mm(run);
    const std::vector<LevelPlan> levels = plan_run(run, Content::part);
    std::vector<Candidate> candidates = template_candidates(run, levels.front(), mode);
    const auto focus = [&] { return focus_of(run, mode); };
    coarse_to_fine(run, Content::part, levels, focus, [&](Level& level, const LevelPlace& place) {
        const double pixel_mm = level.plan().pixel_at_object_mm;
        level.report().cost_initial = level.cost(run.start);
        const bool first = place.is_first;
        candidates = some(judged(run, level, candidates, first ? kFirstJudgement_iterations : kSearchIterations));
        keep_best(candidates, first ? kKeptParts : kPartFinalists, first ? kAnyMargin : kHopelessMargin);
        // Once more, on the pixels that they cover now.
        candidates = some(judged(run, level, candidates, kSearchIterations));
        keep_best(candidates, first ? kFewerParts : kPartFinalists, kHopelessMargin);
        if (place.is_last && !(candidates.front().cost > kHopelessCost_part)) look_about(run, level, candidates);
        result.world_from_ct = candidates.front().world_from_ct;
        result.cost_final = level.report().cost_final = candidates.front().cost;
        take_for_hopeless(run, result.cost_final > kHopelessCost_part);
        if (!place.is_last) {
            if (run.is_hopeless) candidates.resize(1);
            return Next::finer;
        }
        join_valley(run, level, candidates);
        report_rivals(run, candidates, pixel_mm);
        weigh_part(run, level, result.world_from_ct);
        const LevelOutcome found = level.optimize(result.world_from_ct, true, pixel_mm);
        take_for_hopeless(run, found.cost > kHopelessCost_part);  // robust weights go on where it is not
        return Next::finer;
    });
}

}  // namespace raylign::detail

#include <algorithm>
#include <memory>
#include <numbers>

#include "core/base/error.h"
#include "core/registration/strategy/driver.h"
#include "core/base/number_text.h"
#include "core/registration/level/pixel_weights.h"
#include "core/registration/strategy/template_search.h"

namespace raylign {
namespace {

// A global search has more wrong places to tell from the right one: on a real wrist the template of the right pose
// ranked between 10th and 400th.
constexpr std::size_t kTemplates = 2048, kJudgedNear = 128, kJudgedGlobal = 768, kKept = 24, kFewer = 16,
                      kFinalists = 6;
constexpr int kFirstIterations = 5, kIterations = 15;
constexpr double kHopeless = 0.15;  // of cost, above the best: more than a finer level has been seen to make up for
constexpr double kAny = 2;          // the largest difference of costs
constexpr double kDistinct_px = 3;  // ends closer than this are the same
constexpr double kLeastTemplate_px = 5;  // of the object's thickness: a speck fits everywhere
constexpr double kMostReach_px = 60;     // at full resolution: 900,000 places an orientation
constexpr double kNearTurn_deg = 60, kGlobalTurn_deg = 45;
/// Of the object on usable pixels: a sliver of it fits an edge of the field of view better than any bone fits a bone.
constexpr double kLeastSeen = 0.5;

/// Of candidates in order at most `count`, none worse than the best by more than `margin`.
void keep_best(std::vector<Candidate>& candidates, std::size_t count, double margin) {
    if (candidates.size() > count) candidates.resize(count);
    std::erase_if(candidates, [least = candidates.empty() ? 0 : candidates.front().cost, margin](const Candidate& c) {
        return c.cost > least + margin;
    });
}

}  // namespace

std::optional<Focus> Driver::focus_of(Search mode) const {
    if (mode != Search::near) return std::nullopt;
    return Focus{run_.start, range_mm() + kDomainMargin_mm};
}

void Driver::search_part(Search mode) {
    result_.content = Content::part;
    result_.search.mode = mode;
    if (mode == Search::near) result_.search.range_mm = range_mm();
    const std::vector<LevelPlan> levels = plan(Content::part);
    std::vector<Candidate> candidates = template_candidates(levels.front(), mode);
    std::unique_ptr<Level> coarser;
    for (std::size_t i = 0; i < levels.size(); ++i) {
        auto level = std::make_unique<Level>(run_, levels[i], Content::part, focus_of(mode));
        level->report().cost_initial = level->cost(run_.start);
        const bool first = i == 0;
        candidates = judged(*level, candidates, first ? kFirstIterations : kIterations);
        keep_best(candidates, first ? kKept : kFinalists, first ? kAny : kHopeless);
        // Once more, on the pixels that they cover now.
        candidates = judged(*level, candidates, kIterations);
        keep_best(candidates, first ? kFewer : kFinalists, kHopeless);
        result_.world_from_ct = candidates.front().world_from_ct;
        result_.cost_final = level->report().cost_final = candidates.front().cost;
        run_.done_work += level_work(levels[i]);
        if (i + 1 == levels.size()) {
            report_rivals(candidates, levels[i].pixel_at_object_mm);
            if (coarser) weigh_part(*coarser, result_.world_from_ct);
            weigh_part(*level, result_.world_from_ct);
            level->optimize(result_.world_from_ct, true, levels[i].pixel_at_object_mm);
            finish_as_it_needs(*level, coarser.get());
        }
        coarser = std::move(level);
    }
}

std::vector<Candidate> Driver::template_candidates(LevelPlan plan, Search mode) {
    const bool near = mode == Search::near;
    // Everywhere in the field of view is much to look at: half the resolution, if the object's shape survives it.
    const bool wide = !near || range_mm() > kMostReach_px * plan.pixel_at_object_mm;
    if (wide && run_.extent.thickness_mm >= 2 * kLeastTemplate_px * plan.pixel_at_object_mm) {
        ++plan.volume_halvings;
        for (int& halvings : plan.image_halvings) ++halvings;
        plan.pixel_at_object_mm *= 2;
    }
    ++run_.level_count;
    run_.total_work += level_work(plan);
    Level level(run_, plan, Content::part, focus_of(mode));
    if (near) level.check_overlap();
    const double turn_deg =
        run_.options.search.range_deg > 0 ? run_.options.search.range_deg : (near ? kNearTurn_deg : kGlobalTurn_deg);
    const TemplateRange range{.turn_rad = turn_deg * std::numbers::pi / 180,
                              .reach_mm = near ? range_mm() : 0,
                              .spacing_mm = plan.pixel_at_object_mm};
    TemplateFits fits = poses_by_templates(level.session(), level.views(), run_.start, run_.extent, range, kTemplates,
                                           run_.backend.info().threads, [&](double share) {
                                               run_.check_hooks();
                                               run_.show_progress(level.index(), share * level_work(plan), 1);
                                           });
    std::vector<Candidate> candidates =
        distinct(seen(std::move(fits.best)), run_.extent, kDistinct_px * plan.pixel_at_object_mm);
    keep_best(candidates, near ? kJudgedNear : kJudgedGlobal, kAny);
    result_.search.starts = fits.tried;
    result_.search.refined = static_cast<int>(candidates.size());
    run_.done_work += level_work(plan);
    if (candidates.empty()) {
        throw Error("search: no place " +
                    (near ? "within " + fixed(range_mm(), 0) + " mm of the start " : std::string()) +
                    "where every view shows half of the object" +
                    (near ? ": is the start right? A global search needs no more of it than a rough orientation" : ""));
    }
    level.report().cost_initial = level.report().cost_final = candidates.front().cost;
    return candidates;
}

std::vector<Candidate> Driver::seen(std::vector<Candidate> candidates) const {
    std::erase_if(candidates, [this](const Candidate& candidate) {
        return least_seen_share(run_.sample, run_.views, candidate.world_from_ct) < kLeastSeen;
    });
    return candidates;
}

std::vector<Candidate> Driver::judged(Level& level, std::span<const Candidate> candidates, int iterations) {
    const double pixel_mm = level.plan().pixel_at_object_mm;
    const std::vector<Image> even = local_normalisation(level.session(), kNormalisation_mm / pixel_mm);
    std::vector<Candidate> ends;
    for (const Candidate& candidate : candidates) {
        std::vector<Image> weights;
        const std::unique_ptr<Session> session = level.cut_out(candidate.world_from_ct, even, weights);
        if (!session) continue;
        multiply(weights, neighbourhood(*session, candidate.world_from_ct, 0));
        if (!leaves_enough(*session, weights)) continue;
        session->set_weights(weights);
        LevelProblem problem = level.problem(run_.start, false, *session);
        problem.max_iterations = std::min(problem.max_iterations, iterations);
        const std::vector<Candidate> end = refined(problem, {&candidate, 1});
        ends.insert(ends.end(), end.begin(), end.end());
        level.count(*session);
        run_.show_progress(level.index(), 0, candidate.cost);
    }
    ends = distinct(seen(std::move(ends)), run_.extent, kDistinct_px * pixel_mm);
    if (ends.empty()) throw Error("search: no refined pose has a finite cost");
    return ends;
}

void Driver::weigh_part(Level& level, const RigidTransform& centre) const {
    level.session().set_weights(part_weights(level, centre, kDomainMargin_mm));
}

}  // namespace raylign

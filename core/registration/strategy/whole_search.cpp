#include "core/registration/strategy/whole_search.h"

#include <algorithm>
#include <functional>
#include <numbers>

#include "core/base/error.h"
#include "core/registration/level/pixel_weights.h"
#include "core/registration/policy.h"
#include "core/registration/strategy/candidates.h"
#include "core/registration/strategy/coarse_to_fine.h"
#include "core/registration/strategy/finish.h"

namespace raylign::detail {
namespace {

constexpr std::size_t kRefinedStarts = 128, kKeptStarts = 32, kWholeFinalists = 12, kRanked = 6;
constexpr int kFirstLook_iterations = 4, kRankingRounds = 2;

std::vector<RigidTransform> starts_of(const Run& run, Search mode) {
    const SearchOptions& search = run.options.search;
    const double range_rad =
        search.range_deg.value_or(mode == Search::global ? kGlobalTurn_deg : kNearTurn_deg) * std::numbers::pi / 180;
    if (mode == Search::global) {
        return poses_in_view(run.start, run.extent, run.views, range_rad, search.starts.value_or(kGlobalStarts),
                             search.seed);
    }
    return poses_near(run.start, run.extent, search.range_mm.value_or(kNearRange_mm), range_rad,
                      search.starts.value_or(kNearStarts), search.seed);
}

/// The starts of least cost, refined a little.
std::vector<Candidate> first_candidates(Run& run, Level& level, const LevelProblem& problem, Search mode) {
    const std::vector<RigidTransform> starts = starts_of(run, mode);
    std::vector<Candidate> candidates = best_of(problem, starts, kRefinedStarts);
    if (candidates.empty()) throw Error("search: no pose gave a finite cost");
    SearchReport& report = run.result.search;
    report.mode = mode;
    if (mode == Search::near) report.range_mm = run.options.search.range_mm.value_or(kNearRange_mm);
    report.starts = std::ssize(starts);
    report.refined = static_cast<int>(candidates.size());
    LevelProblem first_look = problem;
    first_look.max_iterations = std::min(problem.max_iterations, kFirstLook_iterations);
    candidates = distinct(refined(first_look, candidates), run.extent, level.plan().pixel_at_object_mm);
    if (candidates.size() > kKeptStarts) candidates.resize(kKeptStarts);
    return candidates;
}

/// Finalists compared under weights that are fair to each: the mean of the robust weights that each would choose. What
/// no finalist explains counts little for any. Afterwards the weights are the masks' again: the finish chooses its own.
std::vector<Candidate> ranked_robustly(Run& run, Level& level, std::vector<Candidate> candidates,
                                       const LevelProblem& problem) {
    if (candidates.size() > kRanked) candidates.resize(kRanked);
    Session& session = level.session();
    PixelWeights weights(session);
    std::vector<Image> sum;
    for (Candidate& candidate : candidates) {
        for (int round = 0; round < kRankingRounds; ++round) {
            weights.reweight(candidate.world_from_ct);
            const std::vector<Candidate> end = refined(problem, {&candidate, 1});
            if (!end.empty()) candidate = end.front();
        }
        for (std::size_t v = 0; v < session.view_count(); ++v) {
            const Image& own = session.fixed_channels(v).weights;
            if (sum.size() <= v) sum.emplace_back(own.width, own.height);
            std::ranges::transform(sum[v].pixels, own.pixels, sum[v].pixels.begin(), std::plus<>());
        }
    }
    session.set_weights(sum);
    ++run.result.robust_rounds;
    candidates = distinct(refined(problem, candidates), run.extent, kDistinct_px * level.plan().pixel_at_object_mm);
    for (Image& image : sum) std::ranges::fill(image.pixels, 1.f);
    session.set_weights(sum);
    return candidates;
}

}  // namespace

void search_whole(Run& run, Search mode, StartCheck check) {
    RegistrationResult& result = run.result;
    const std::vector<LevelPlan> levels = plan_run(run, Content::whole);
    std::vector<Candidate> candidates;
    const auto everything = []() -> std::optional<Focus> { return std::nullopt; };
    coarse_to_fine(run, Content::whole, levels, everything, [&](Level& level, const LevelPlace& place) {
        if (place.is_first && mode == Search::near && check == StartCheck::overlap) level.check_overlap();
        const double pixel_mm = level.plan().pixel_at_object_mm;
        level.report().cost_initial = level.cost(run.start);
        LevelProblem problem = level.problem(run.start, false);
        problem.max_iterations = std::min(problem.max_iterations, kSearchIterations);
        if (place.is_first) candidates = first_candidates(run, level, problem, mode);
        candidates = distinct(refined(problem, candidates), run.extent, kDistinct_px * pixel_mm);
        if (candidates.empty()) throw Error("search: no refined pose has a finite cost");
        if (candidates.size() > kWholeFinalists) candidates.resize(kWholeFinalists);
        result.world_from_ct = candidates.front().world_from_ct;
        result.cost_final = level.report().cost_final = candidates.front().cost;
        if (!place.is_last) return Next::finer;
        const bool is_robust = wants_robust_weights(run, level);
        if (is_robust) candidates = ranked_robustly(run, level, std::move(candidates), problem);
        result.world_from_ct = candidates.front().world_from_ct;
        report_rivals(run, candidates, pixel_mm);
        if (is_robust) {
            level.report().cost_final = level.cost(result.world_from_ct);  // the finish goes on from here
        } else {
            level.optimize(result.world_from_ct, true, pixel_mm);
        }
        return Next::finer;
    });
}

}  // namespace raylign::detail

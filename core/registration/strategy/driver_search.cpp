#include <algorithm>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>

#include "core/base/error.h"
#include "core/registration/strategy/driver.h"
#include "core/registration/level/pixel_weights.h"

namespace raylign {
namespace {

constexpr double kNearRange_mm = 20, kNearRange_deg = 60, kGlobalRange_deg = 45;
constexpr int kNearStarts = 6144, kGlobalStarts = 8192;
constexpr std::size_t kRefined = 128, kKept = 32, kFinalists = 12, kRanked = 6;
constexpr int kFirstIterations = 4, kIterations = 15, kRankingRounds = 2;
constexpr double kDistinct_px = 3;  // ends closer than this are the same
constexpr double kRival_px = 6;     // rivals are at least this far apart

}  // namespace

void Driver::search_whole(Search mode) {
    result_.content = Content::whole;
    const std::vector<LevelPlan> levels = plan(Content::whole);
    std::vector<Candidate> candidates;
    std::unique_ptr<Level> coarser;
    for (std::size_t i = 0; i < levels.size(); ++i) {
        auto level = std::make_unique<Level>(run_, levels[i], Content::whole);
        if (run_.levels_made == 1 && mode == Search::near) level->check_overlap();
        level->report().cost_initial = level->cost(run_.start);
        LevelProblem problem = level->problem(run_.start, false);
        problem.max_iterations = std::min(problem.max_iterations, kIterations);
        if (i == 0) candidates = first_candidates(*level, problem, mode);
        candidates = distinct(refined(problem, candidates), run_.extent, kDistinct_px * levels[i].pixel_at_object_mm);
        if (candidates.empty()) throw Error("search: no refined pose has a finite cost");
        if (candidates.size() > kFinalists) candidates.resize(kFinalists);
        result_.world_from_ct = candidates.front().world_from_ct;
        result_.cost_final = level->report().cost_final = candidates.front().cost;
        run_.done_work += level_work(levels[i]);
        if (i + 1 == levels.size()) {
            candidates = ranked_robustly(*level, std::move(candidates), problem);
            result_.world_from_ct = candidates.front().world_from_ct;
            report_rivals(candidates, levels[i].pixel_at_object_mm);
            level->optimize(result_.world_from_ct, true, levels[i].pixel_at_object_mm);
            finish_as_it_needs(*level, coarser.get());
        }
        coarser = std::move(level);
    }
}

std::vector<RigidTransform> Driver::starts_of(Search mode) const {
    const SearchOptions& search = run_.options.search;
    const double default_deg = mode == Search::global ? kGlobalRange_deg : kNearRange_deg;
    const double range_rad = (search.range_deg > 0 ? search.range_deg : default_deg) * std::numbers::pi / 180;
    if (mode == Search::global) {
        return poses_in_view(run_.start, run_.extent, run_.views, range_rad,
                             search.starts > 0 ? search.starts : kGlobalStarts, search.seed);
    }
    return poses_near(run_.start, run_.extent, range_mm(), range_rad, search.starts > 0 ? search.starts : kNearStarts,
                      search.seed);
}

double Driver::range_mm() const {
    return run_.options.search.range_mm > 0 ? run_.options.search.range_mm : kNearRange_mm;
}

std::vector<Candidate> Driver::first_candidates(Level& level, const LevelProblem& problem, Search mode) {
    const std::vector<RigidTransform> starts = starts_of(mode);
    std::vector<Candidate> candidates = best_of(problem, starts, kRefined);
    if (candidates.empty()) throw Error("search: no pose gave a finite cost");
    result_.search.mode = mode;
    if (mode == Search::near) result_.search.range_mm = range_mm();
    result_.search.starts = std::ssize(starts);
    result_.search.refined = static_cast<int>(candidates.size());
    LevelProblem brief = problem;
    brief.max_iterations = std::min(problem.max_iterations, kFirstIterations);
    candidates = distinct(refined(brief, candidates), run_.extent, level.plan().pixel_at_object_mm);
    if (candidates.size() > kKept) candidates.resize(kKept);
    return candidates;
}

std::vector<Candidate> Driver::ranked_robustly(Level& level, std::vector<Candidate> candidates,
                                               const LevelProblem& problem) {
    if (!is_robust(level)) return candidates;
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
    ++result_.robust_rounds;
    return distinct(refined(problem, candidates), run_.extent, kDistinct_px * level.plan().pixel_at_object_mm);
}

void Driver::report_rivals(const std::vector<Candidate>& candidates, double pixel_mm) {
    const Candidate& best = candidates.front();
    result_.search.cost = best.cost;
    result_.search.agreeing = best.agreeing;
    for (const Candidate& other : candidates) {
        if (apart_mm(best.world_from_ct, other.world_from_ct, run_.extent) < kRival_px * pixel_mm) continue;
        const RigidTransform moved = other.world_from_ct * inverse(best.world_from_ct);
        const Eigen::Vector3d centre_mm = best.world_from_ct * run_.extent.centre_ct_mm;
        result_.search.rivals.push_back({other.world_from_ct, other.cost, (moved * centre_mm - centre_mm).norm(),
                                         rotation_angle_rad(moved) * 180 / std::numbers::pi});
    }
}

}  // namespace raylign

#include "core/registration/strategy/judged.h"

#include <algorithm>

#include "core/registration/level/pixel_weights.h"
#include "core/registration/policy.h"

namespace raylign::detail {
namespace {

constexpr double kAboutTurn_rad = 0.25, kAboutShift_radii = 0.2;
constexpr int kAboutRounds = 3;

/// Ends of searches closer than this are the same.
double distinct_mm(const Level& level) { return kDistinct_px * level.plan().pixel_at_object_mm; }

std::vector<Candidate> about(const Run& run, const RigidTransform& pose) {
    std::vector<Candidate> poses;
    const Eigen::Vector3d centre_mm = pose * run.extent.centre_ct_mm;
    for (int k = 0; k < 6; ++k) {
        for (const double sign : {-1.0, 1.0}) {
            Twist twist = Twist::Zero();
            twist[k] = sign * (k < 3 ? kAboutTurn_rad : kAboutShift_radii * run.extent.radius_mm);
            poses.push_back({exp_about(twist, centre_mm) * pose, 0, 1});
        }
    }
    return poses;
}

}  // namespace

std::vector<Candidate> shown_enough(const Run& run, std::vector<Candidate> candidates) {
    std::erase_if(candidates, [&](const Candidate& candidate) {
        return least_seen_share(run.resident.sample(), run.views, candidate.world_from_ct) < kLeastSeen_part;
    });
    return candidates;
}

std::vector<Candidate> judged(Run& run, Level& level, std::span<const Candidate> candidates, int iterations) {
    const std::vector<Image> even =
        local_normalisation(level.session(), kNormalisation_mm / level.plan().pixel_at_object_mm);
    std::vector<Candidate> ends;
    for (const Candidate& candidate : candidates) {
        std::vector<Image> weights;
        const std::unique_ptr<Session> session = level.cut_out(candidate.world_from_ct, even, weights);
        if (!session) continue;
        multiply(weights, neighbourhood(*session, candidate.world_from_ct, 0));
        if (!leaves_enough(*session, weights)) continue;
        session->set_weights(weights);
        LevelProblem problem = level.problem(run.start, false, *session);
        problem.max_iterations = std::min(problem.max_iterations, iterations);
        const std::vector<Candidate> end = refined(problem, {&candidate, 1});
        ends.insert(ends.end(), end.begin(), end.end());
        level.count(*session);
        show_progress(run, level.index(), 0, candidate.cost);
    }
    return distinct(shown_enough(run, std::move(ends)), run.extent, distinct_mm(level));
}

void look_about(Run& run, Level& level, std::vector<Candidate>& candidates) {
    for (int round = 0; round < kAboutRounds; ++round) {
        const RigidTransform best = candidates.front().world_from_ct;
        const std::vector<Candidate> starts = about(run, best);
        run.result.search.refined += static_cast<int>(starts.size());
        std::vector<Candidate> ends = judged(run, level, starts, kSearchIterations);
        ends = judged(run, level, ends, kSearchIterations);  // once more, on the pixels that they cover now
        candidates.insert(candidates.end(), ends.begin(), ends.end());
        candidates = distinct(std::move(candidates), run.extent, distinct_mm(level));
        if (apart_mm(candidates.front().world_from_ct, best, run.extent) < distinct_mm(level)) return;
    }
}

}  // namespace raylign::detail

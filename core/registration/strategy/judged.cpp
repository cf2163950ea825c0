#include "core/registration/strategy/judged.h"

#include <algorithm>

#include "core/registration/level/pixel_weights.h"
#include "core/registration/policy.h"

namespace raylign::detail {
namespace {

constexpr double kAboutTurn_rad = 0.25, kAboutShift_radii = 0.2;
constexpr int kAboutRounds = 3;
constexpr double kValley_radii = 0.3;  // as far as descents from around the best begin, and more
constexpr int kValleySteps = 6;

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

/// Views cut out and weighed for the pixels that a candidate covers; null where these are too few.
std::unique_ptr<Session> session_for(Level& level, const RigidTransform& pose, std::span<const Image> even) {
    std::vector<Image> weights;
    std::unique_ptr<Session> session = level.cut_out(pose, even, weights);
    if (!session) return nullptr;
    multiply(weights, neighbourhood(*session, pose, 0));
    if (!leaves_enough(*session, weights)) return nullptr;
    session->set_weights(weights);
    return session;
}

std::vector<Image> even_weights(Level& level) {
    return local_normalisation(level.session(), kNormalisation_mm / level.plan().pixel_at_object_mm);
}

/// True where the cost nowhere between two places exceeds that of both.
bool share_a_valley(const Run& run, Session& session, const RigidTransform& from, const RigidTransform& to) {
    const Eigen::Vector3d centre_mm = from * run.extent.centre_ct_mm;
    const Eigen::Vector3d shift_mm = to * run.extent.centre_ct_mm - centre_mm;
    const Eigen::Vector3d turn_rad = log({to.rotation * from.rotation.transpose(), Eigen::Vector3d::Zero()}).head<3>();
    std::vector<RigidTransform> way;
    for (int i = 0; i <= kValleySteps; ++i) {
        const double share = static_cast<double>(i) / kValleySteps;
        Twist turn = Twist::Zero();
        turn.head<3>() = share * turn_rad;
        way.push_back(RigidTransform::translate(share * shift_mm) * exp_about(turn, centre_mm) * from);
    }
    std::vector<double> costs(way.size());
    session.evaluate(way, costs);
    return std::ranges::all_of(costs, [&](double cost) { return cost <= std::max(costs.front(), costs.back()); });
}

}  // namespace

std::vector<Candidate> shown_enough(const Run& run, std::vector<Candidate> candidates) {
    std::erase_if(candidates, [&](const Candidate& candidate) {
        return least_seen_share(run.resident.sample(), run.views, candidate.world_from_ct) < kLeastSeen_part;
    });
    return candidates;
}

std::vector<Candidate> judged(Run& run, Level& level, std::span<const Candidate> candidates, int iterations) {
    const std::vector<Image> even = even_weights(level);
    std::vector<Candidate> ends;
    for (const Candidate& candidate : candidates) {
        const std::unique_ptr<Session> session = session_for(level, candidate.world_from_ct, even);
        if (!session) continue;
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

void join_valley(Run& run, Level& level, std::vector<Candidate>& candidates) {
    Candidate& best = candidates.front();
    const std::unique_ptr<Session> session = session_for(level, best.world_from_ct, even_weights(level));
    if (!session) return;
    std::vector<Candidate> kept{best};
    for (const Candidate& other : std::span(candidates).subspan(1)) {
        const bool is_near =
            apart_mm(best.world_from_ct, other.world_from_ct, run.extent) < kValley_radii * run.extent.radius_mm;
        if (is_near && share_a_valley(run, *session, best.world_from_ct, other.world_from_ct)) {
            kept.front().agreeing += other.agreeing;
        } else {
            kept.push_back(other);
        }
    }
    level.count(*session);
    candidates = std::move(kept);
}

}  // namespace raylign::detail

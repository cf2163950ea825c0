#include "core/registration/strategy/candidates.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string>

#include "core/base/error.h"
#include "core/base/random.h"

namespace raylign::detail {
namespace {

constexpr std::size_t kBatch = 256;  // between two looks at the clock
constexpr double kRival_px = 6;      // rivals are at least this far apart

/// The pose turned by the rotation vector about the object's centre, then shifted.
RigidTransform moved(const RigidTransform& pose, const ObjectExtent& extent, const Eigen::Vector3d& turn_rad,
                     const Eigen::Vector3d& shift_mm) {
    Twist turn = Twist::Zero();
    turn.head<3>() = turn_rad;
    return RigidTransform::translate(shift_mm) * exp_about(turn, pose * extent.centre_ct_mm) * pose;
}

}  // namespace

double field_mm(std::span<const View> views, const Eigen::Vector3d& point_world_mm) {
    double widest_mm = 0;
    for (const View& view : views) {
        const double depth_mm = (view.geometry.camera_from_world * point_world_mm).z();
        const Eigen::Vector2d focal_px = view.geometry.camera.intrinsics_px.diagonal().head<2>();
        const Eigen::Vector2d size_mm = depth_mm * view.geometry.camera.size_px.cast<double>().cwiseQuotient(focal_px);
        widest_mm = std::max(widest_mm, size_mm.maxCoeff());
    }
    return widest_mm;
}

std::vector<RigidTransform> poses_near(const RigidTransform& centre, const ObjectExtent& extent, double range_mm,
                                       double range_rad, int count, std::uint64_t seed) {
    std::vector<RigidTransform> poses{centre};
    Random random(seed);
    while (std::ssize(poses) < count) {
        const double apart_mm = range_mm * random.uniform(), share = random.uniform();
        const double turn_rad = std::min(std::sqrt(share) * apart_mm / extent.radius_mm, range_rad);
        const Eigen::Vector3d turn = turn_rad * random.direction();
        poses.push_back(moved(centre, extent, turn, std::sqrt(1 - share) * apart_mm * random.direction()));
    }
    return poses;
}

std::vector<RigidTransform> poses_in_view(const RigidTransform& nominal, const ObjectExtent& extent,
                                          std::span<const View> views, double range_rad, int count,
                                          std::uint64_t seed) {
    const Eigen::Vector3d centre_mm = nominal * extent.centre_ct_mm;
    const double side_mm = field_mm(views, centre_mm);
    std::vector<RigidTransform> poses{nominal};
    Random random(seed);
    for (long long tries = 0; std::ssize(poses) < count; ++tries) {
        if (tries > 1000LL * count) throw Error("global search: hardly any point is seen by all views");
        // One draw per statement: compilers differ in which argument they evaluate first.
        const double z = random.uniform(-0.5, 0.5), y = random.uniform(-0.5, 0.5), x = random.uniform(-0.5, 0.5);
        const Eigen::Vector3d shift_mm = side_mm * Eigen::Vector3d(x, y, z);
        const Eigen::Vector3d axis = random.direction();
        const Eigen::Vector3d turn = range_rad * std::cbrt(random.uniform()) * axis;
        const auto sees = [&](const View& view) { return is_seen(view, centre_mm + shift_mm); };
        if (std::ranges::all_of(views, sees)) poses.push_back(moved(nominal, extent, turn, shift_mm));
    }
    return poses;
}

std::vector<Candidate> distinct(std::vector<Candidate> candidates, const ObjectExtent& extent, double within_mm) {
    std::ranges::stable_sort(candidates, {}, &Candidate::cost);
    std::vector<Candidate> kept;
    for (const Candidate& candidate : candidates) {
        const auto same = std::ranges::find_if(kept, [&](const Candidate& k) {
            return apart_mm(k.world_from_ct, candidate.world_from_ct, extent) < within_mm;
        });
        if (same == kept.end()) {
            kept.push_back(candidate);
        } else {
            same->agreeing += candidate.agreeing;
        }
    }
    return kept;
}

std::vector<Candidate> best_of(const LevelProblem& problem, std::span<const RigidTransform> poses, std::size_t count) {
    std::vector<double> costs(poses.size());
    for (std::size_t i = 0; i < poses.size(); i += kBatch) {
        const std::size_t n = std::min(kBatch, poses.size() - i);
        problem.before_batch();
        problem.session.evaluate(poses.subspan(i, n), {costs.data() + i, n});
    }
    std::vector<Candidate> candidates;
    for (std::size_t i = 0; i < poses.size(); ++i) {
        if (std::isfinite(costs[i])) candidates.push_back({poses[i], costs[i], 1});
    }
    std::ranges::stable_sort(candidates, {}, &Candidate::cost);
    if (candidates.size() > count) candidates.resize(count);
    return candidates;
}

std::vector<Candidate> refined(const LevelProblem& problem, std::span<const Candidate> candidates) {
    std::vector<RigidTransform> starts;
    for (const Candidate& candidate : candidates) starts.push_back(candidate.world_from_ct);
    const std::vector<LevelOutcome> ends = run_gauss_newton_batch(problem, starts);
    std::vector<Candidate> result;
    for (std::size_t i = 0; i < ends.size(); ++i) {
        if (!std::isfinite(ends[i].cost)) continue;
        result.push_back({ends[i].world_from_ct, ends[i].cost, candidates[i].agreeing});
    }
    return result;
}

void report_rivals(Run& run, const std::vector<Candidate>& candidates, double pixel_mm) {
    const Candidate& best = candidates.front();
    SearchReport& report = run.result.search;
    report.cost = best.cost;
    report.agreeing = best.agreeing;
    report.rivals.clear();
    for (const Candidate& other : candidates) {
        if (apart_mm(best.world_from_ct, other.world_from_ct, run.extent) < kRival_px * pixel_mm) continue;
        const RigidTransform moved = other.world_from_ct * inverse(best.world_from_ct);
        const Eigen::Vector3d centre_mm = best.world_from_ct * run.extent.centre_ct_mm;
        report.rivals.push_back({other.world_from_ct, other.cost, (moved * centre_mm - centre_mm).norm(),
                                 rotation_angle_rad(moved) * 180 / std::numbers::pi});
    }
}

}  // namespace raylign::detail

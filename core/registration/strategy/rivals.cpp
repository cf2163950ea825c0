#include "core/registration/strategy/rivals.h"

#include <algorithm>
#include <numbers>

#include "core/registration/policy.h"
#include "core/registration/strategy/candidates.h"
#include "core/registration/strategy/coarse_to_fine.h"
#include "core/registration/strategy/domain.h"

namespace raylign::detail {
namespace {

constexpr double kTurn_rad = 20 * std::numbers::pi / 180, kWideTurn_rad = 2 * kTurn_rad;
constexpr double kShift_radii = 0.25, kDepth_radii = 0.5;
constexpr double kWorthALook = 0.15;  // of cost on the coarsest level, above the result's
constexpr std::size_t kMostRivals = 4;
constexpr double kPoorlyExplained = 0.25;  // of a view: right poses of a whole rarely leave so much, wrong ones more
constexpr double kFarTurn_rad = 60 * std::numbers::pi / 180;
constexpr int kFarPoses = 512;
constexpr std::size_t kFarRefined = 24;
constexpr double kCutRange_mm = 20, kCutTurn_rad = 15 * std::numbers::pi / 180;
constexpr int kCutPoses = 64;
constexpr double kBetter = 0.005;  // of cost: more than two ends of one minimum differ by

/// Columns: the first view's axes in world; the last one is depth.
Eigen::Matrix3d view_axes(const View& view) { return view.geometry.camera_from_world.rotation.transpose(); }

RigidTransform turned(const Run& run, const RigidTransform& pose, const Eigen::Vector3d& turn_rad,
                      const Eigen::Vector3d& shift_mm) {
    Twist twist;
    twist << turn_rad, shift_mm;
    return exp_about(twist, pose * run.extent.centre_ct_mm) * pose;
}

/// R' = S R S_i: S mirrors through the image plane, S_i through the object's plane across its i-th axis. Two mirrors
/// are a rotation.
RigidTransform mirrored(const Run& run, const RigidTransform& pose, const Eigen::Vector3d& depth, int axis) {
    const Eigen::Matrix3d flip = Eigen::Matrix3d::Identity() - 2 * depth * depth.transpose();
    const Eigen::Vector3d across = run.volume().grid.direction.col(axis);
    const Eigen::Matrix3d own = Eigen::Matrix3d::Identity() - 2 * across * across.transpose();
    RigidTransform result = pose;
    result.rotation = flip * pose.rotation * own;
    const Eigen::Vector3d centre_mm = pose * run.extent.centre_ct_mm;
    result.translation_mm = centre_mm - result.rotation * run.extent.centre_ct_mm;
    return result;
}

std::vector<Candidate> starts_around(const Run& run, const RigidTransform& pose) {
    const Eigen::Matrix3d axes = view_axes(run.views.front());
    const double radius_mm = run.extent.radius_mm;
    const Eigen::Vector3d none = Eigen::Vector3d::Zero();
    std::vector<Candidate> starts{{pose, 0, 1}};
    const bool single = run.views.size() == 1;
    for (const double sign : {-1.0, 1.0}) {
        for (int i = 0; i < 3; ++i) {
            const Eigen::Vector3d axis = sign * axes.col(i);
            starts.push_back({turned(run, pose, kTurn_rad * axis, none), 0, 1});
            if (i == 0 || single) starts.push_back({turned(run, pose, none, kShift_radii * radius_mm * axis), 0, 1});
            if (!single) continue;
            if (i < 2) starts.push_back({turned(run, pose, kWideTurn_rad * axis, none), 0, 1});
            if (i == 2) starts.push_back({turned(run, pose, none, kDepth_radii * radius_mm * axis), 0, 1});
        }
    }
    for (int i = 0; single && i < 3; ++i) starts.push_back({mirrored(run, pose, axes.col(2), i), 0, 1});
    return starts;
}

/// Far around: random poses within the object's radius and 60 degrees.
std::vector<RigidTransform> poses_far_around(const Run& run, const RigidTransform& pose) {
    return poses_near(pose, run.extent, run.extent.radius_mm, kFarTurn_rad, kFarPoses, run.options.search.seed);
}

/// The ends of descents on a level of its own.
std::vector<Candidate> ends_on(Run& run, const LevelPlan& plan, const RigidTransform& pose,
                               std::vector<Candidate> starts, std::span<const RigidTransform> far = {}) {
    std::vector<Candidate> ends;
    on_level_beside(run, run.views, plan, [&](Run& beside, Level& level) {
        weigh_whole(beside, level, pose);
        LevelProblem problem = level.problem(pose, false);
        problem.max_iterations = std::min(problem.max_iterations, kSearchIterations);
        const std::vector<Candidate> best = best_of(problem, far, kFarRefined);
        starts.insert(starts.end(), best.begin(), best.end());
        ends = distinct(refined(problem, starts), run.extent, kDistinct_px * plan.pixel_at_object_mm);
    });
    return ends;
}

/// The end that the pose itself belongs to.
std::vector<Candidate>::const_iterator own_of(const Run& run, const std::vector<Candidate>& ends,
                                              const RigidTransform& pose) {
    return std::ranges::min_element(
        ends, {}, [&](const Candidate& end) { return apart_mm(end.world_from_ct, pose, run.extent); });
}

}  // namespace

std::optional<RigidTransform> look_for_rivals(Run& run) {
    RegistrationResult& result = run.result;
    const RigidTransform pose = result.world_from_ct;
    const std::vector<LevelPlan> levels =
        plan_levels(run.volume(), run.views, pose, run.extent, run.options.similarity.filter, run.options.levels);
    const std::vector<Candidate> starts = starts_around(run, pose);
    std::vector<RigidTransform> far;
    if (std::ranges::any_of(run.explained_view_costs, [](double cost) { return !(cost < kPoorlyExplained); })) {
        far = poses_far_around(run, pose);
    }
    std::vector<Candidate> ends = ends_on(run, levels.front(), pose, starts, far);
    if (ends.empty()) return std::nullopt;
    const Candidate own = *own_of(run, ends, pose);
    result.search.starts = std::ssize(starts) + std::ssize(far);
    result.search.refined = static_cast<int>(starts.size() + std::min(far.size(), kFarRefined));
    std::erase_if(ends, [&](const Candidate& end) { return end.cost > own.cost + kWorthALook; });
    if (ends.size() > kMostRivals) ends.resize(kMostRivals);
    if (ends.size() > 1 && levels.size() > 1) {
        ends.push_back({pose, 0, 0});
        ends = ends_on(run, levels[1], pose, ends);
        if (ends.empty()) return std::nullopt;
    }
    const auto mine = own_of(run, ends, pose);
    const Candidate best = ends.front();
    std::vector<Candidate> in_order{*mine};
    for (auto end = ends.cbegin(); end != ends.cend(); ++end) {
        if (end != mine) in_order.push_back(*end);
    }
    result.search.rivals.clear();
    report_rivals(run, in_order, levels.front().pixel_at_object_mm);
    if (best.cost < in_order.front().cost - kBetter) return best.world_from_ct;
    return std::nullopt;
}

std::optional<RigidTransform> from_the_start_again(Run& run) {
    const RigidTransform pose = run.result.world_from_ct;
    if (run.shows_the_cut.value_or(true) || !(run.result.cost_final >= kPoorCost_cut)) return std::nullopt;
    const std::vector<LevelPlan> levels =
        plan_levels(run.volume(), run.views, pose, run.extent, run.options.similarity.filter, run.options.levels);
    if (levels.size() < 2) return std::nullopt;
    const std::vector<RigidTransform> near =
        poses_near(run.start, run.extent, kCutRange_mm, kCutTurn_rad, kCutPoses, run.options.search.seed);
    const std::vector<Candidate> ends = ends_on(run, levels[1], run.start, {{run.start, 0, 1}}, near);
    const std::vector<Candidate> own = ends_on(run, levels[1], pose, {{pose, 0, 1}});
    if (ends.empty() || own.empty() || !(ends.front().cost < own.front().cost - kBetter)) return std::nullopt;
    return ends.front().world_from_ct;
}

}  // namespace raylign::detail

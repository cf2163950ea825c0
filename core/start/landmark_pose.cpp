#include "raylign/start.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <set>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"

namespace raylign {
using namespace detail;
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Problem {
    std::span<const Eigen::Vector3d> points;
    std::span<const ViewGeometry> views;
    std::span<const LandmarkSighting> sightings;
    Eigen::Vector3d centre_ct;
    double radius_mm = 1;  ///< root mean square distance from the centre: scales rotations
};

/// Sum of squared residuals [px^2], gradient / 2 and J^T J in the scaled twist (radius w, v) about the centre.
struct Normal {
    double cost = kInfinity;
    Eigen::Matrix<double, 6, 6> matrix = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> gradient = Eigen::Matrix<double, 6, 1>::Zero();
};

Normal normal_at(const Problem& problem, const RigidTransform& world_from_ct) {
    Normal normal;
    double cost = 0;
    const Eigen::Vector3d centre = world_from_ct * problem.centre_ct;
    for (const LandmarkSighting& sighting : problem.sightings) {
        const ViewGeometry& view = problem.views[sighting.view];
        const Eigen::Vector3d world = world_from_ct * problem.points[sighting.landmark];
        const Eigen::Vector3d p = view.camera.intrinsics_px * (view.camera_from_world * world);
        if (!(p.z() > 0)) return {};
        const Eigen::Vector2d residual = p.head<2>() / p.z() - sighting.pixel;
        // d(world) = w x (world - centre) + v; d(pixel) = (dp_xy - pixel dp_z) / p_z.
        const Eigen::Vector3d arm = world - centre;
        Eigen::Matrix<double, 3, 6> moved;
        moved << 0, arm.z(), -arm.y(), 1, 0, 0, -arm.z(), 0, arm.x(), 0, 1, 0, arm.y(), -arm.x(), 0, 0, 0, 1;
        moved.leftCols<3>() /= problem.radius_mm;
        const Eigen::Matrix<double, 3, 6> dp = view.camera.intrinsics_px * view.camera_from_world.rotation * moved;
        const Eigen::Matrix<double, 2, 6> jacobian = (dp.topRows<2>() - (p.head<2>() / p.z()) * dp.row(2)) / p.z();
        cost += residual.squaredNorm();
        normal.gradient += jacobian.transpose() * residual;
        normal.matrix += jacobian.transpose() * jacobian;
    }
    normal.cost = cost;
    return normal;
}

RigidTransform moved_by(const Problem& problem, const RigidTransform& world_from_ct,
                        const Eigen::Matrix<double, 6, 1>& step) {
    Twist twist = step;
    twist.head<3>() /= problem.radius_mm;
    return exp_about(twist, world_from_ct * problem.centre_ct) * world_from_ct;
}

/// Levenberg-Marquardt [Marquardt63]. The driver's own search stops at 1e-3 mm, for images; here rounding is the
/// end.
std::pair<RigidTransform, double> refined(const Problem& problem, RigidTransform world_from_ct) {
    constexpr int kMostSteps = 200;
    Normal here = normal_at(problem, world_from_ct);
    if (here.cost == kInfinity) return {world_from_ct, kInfinity};
    double damping = 1e-3;
    for (int i = 0; i < kMostSteps && damping < 1e12; ++i) {
        Eigen::Matrix<double, 6, 6> damped = here.matrix;
        damped.diagonal() += damping * (here.matrix.diagonal().array() + 1e-12 * here.matrix.trace()).matrix();
        const Eigen::Matrix<double, 6, 1> step = -solve_symmetric(damped, here.gradient);
        if (!step.allFinite()) break;
        const RigidTransform trial = moved_by(problem, world_from_ct, step);
        Normal there = normal_at(problem, trial);
        if (!(there.cost < here.cost)) {
            damping *= 8;
            continue;
        }
        world_from_ct = trial;
        here = there;
        damping = std::max(1e-12, damping * 0.2);
        if (step.norm() < 1e-12 * (1 + problem.radius_mm)) break;
    }
    return {world_from_ct, here.cost};
}

/// `count` rotations spread evenly over SO(3): the super-Fibonacci spiral of [Alexa 2022].
std::vector<Eigen::Matrix3d> even_rotations(int count) {
    const double phi = std::numbers::sqrt2, psi = 1.533751168755204288118041;
    std::vector<Eigen::Matrix3d> rotations;
    for (int i = 0; i < count; ++i) {
        const double s = i + 0.5, r = std::sqrt(s / count), big = std::sqrt(1 - s / count);
        const double alpha = 2 * std::numbers::pi * s / phi, beta = 2 * std::numbers::pi * s / psi;
        rotations.push_back(
            Eigen::Quaterniond(big * std::cos(beta), r * std::sin(alpha), r * std::cos(alpha), big * std::sin(beta))
                .toRotationMatrix());
    }
    return rotations;
}

/// Where the landmarks' centre may be: the point nearest to the rays through each view's mean sighting, and in the
/// direction that the rays leave open at the depth at which the spread of the points matches that of the pixels.
Eigen::Vector3d centre_world(const Problem& problem) {
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (std::size_t v = 0; v < problem.views.size(); ++v) {
        const ViewGeometry& view = problem.views[v];
        Eigen::Vector2d mean = Eigen::Vector2d::Zero();
        double count = 0, spread_px = 0;
        for (const LandmarkSighting& s : problem.sightings) {
            if (s.view != v) continue;
            mean += s.pixel;
            ++count;
        }
        if (count == 0) continue;
        mean /= count;
        for (const LandmarkSighting& s : problem.sightings) {
            if (s.view == v) spread_px += (s.pixel - mean).squaredNorm() / count;
        }
        const Eigen::Vector3d ray = ray_direction_world(view, mean), source = source_world_mm(view);
        const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray * ray.transpose();
        // Two of three directions of the spread are seen.
        const double seen_mm = problem.radius_mm * std::sqrt(2.0 / 3.0);
        const double depth_mm = view.camera.intrinsics_px(0, 0) * seen_mm / std::max(1e-6, std::sqrt(spread_px));
        constexpr double kDepthWeight = 1e-4;  // decides only what no second ray decides
        matrix += count * (across + kDepthWeight * ray * ray.transpose());
        right += count * (across * source + kDepthWeight * ray * ray.dot(source + depth_mm * ray));
    }
    return solve_symmetric(matrix, right);
}

void check_landmarks(const Problem& problem, const std::set<std::size_t>& seen) {
    if (seen.size() < 4) {
        throw bad_value("landmarks with a point in an image", std::to_string(seen.size()), "at least 4");
    }
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (const std::size_t i : seen) {
        const Eigen::Vector3d arm = problem.points[i] - problem.centre_ct;
        scatter += arm * arm.transpose();
    }
    const Eigen::Vector3d extents = principal_axes(scatter).values;
    const double longest = std::sqrt(std::max(0.0, extents[2]));
    const double second = std::sqrt(std::max(0.0, extents[1]));
    if (!(longest > 0) || second < 0.05 * longest) {
        throw Error("the landmarks lie on a line (second principal extent " + std::to_string(second) + " mm of " +
                    std::to_string(longest) + " mm): the turn about it is open; add one beside it");
    }
    for (const LandmarkSighting& s : problem.sightings) {
        const Eigen::Vector2d size = problem.views[s.view].camera.size_px.cast<double>();
        if ((s.pixel.array() > -size.array()).all() && (s.pixel.array() < 2 * size.array()).all()) continue;
        throw bad_value("landmark " + std::to_string(s.landmark + 1) + " in view " + std::to_string(s.view + 1),
                        "(" + std::to_string(s.pixel.x()) + ", " + std::to_string(s.pixel.y()) + ") px",
                        "near the image of " + std::to_string(problem.views[s.view].camera.size_px.x()) + " x " +
                            std::to_string(problem.views[s.view].camera.size_px.y()));
    }
}

void measure(const Problem& problem, LandmarkPose& pose) {
    double sum_px = 0, sum_mm = 0;
    for (const LandmarkSighting& s : problem.sightings) {
        const ViewGeometry& view = problem.views[s.view];
        const Eigen::Vector3d world = pose.world_from_ct * problem.points[s.landmark];
        const double residual_px = (project(view, world) - s.pixel).norm();
        const double mm_per_px = (view.camera_from_world * world).z() / view.camera.intrinsics_px(0, 0);
        pose.residuals_px.push_back(residual_px);
        sum_px += residual_px * residual_px;
        sum_mm += residual_px * residual_px * mm_per_px * mm_per_px;
    }
    const auto count = static_cast<double>(problem.sightings.size());
    pose.rms_px = std::sqrt(sum_px / count);
    pose.rms_mm = std::sqrt(sum_mm / count);
}

/// Farther apart than 5 degrees or a tenth of the landmarks' extent: not the same minimum.
bool is_different(const Problem& problem, const RigidTransform& a, const RigidTransform& b) {
    const RigidTransform between = a * inverse(b);
    const double shift_mm = (a * problem.centre_ct - b * problem.centre_ct).norm();
    return rotation_angle_rad(between) > 5 * std::numbers::pi / 180 || shift_mm > 0.1 * problem.radius_mm;
}

}  // namespace

LandmarkPose pose_from_landmarks(std::span<const Eigen::Vector3d> landmarks_ct_mm, std::span<const ViewGeometry> views,
                                 std::span<const LandmarkSighting> sightings) {
    Problem problem{landmarks_ct_mm, views, sightings, Eigen::Vector3d::Zero()};
    std::set<std::size_t> seen;
    for (const LandmarkSighting& s : sightings) seen.insert(s.landmark);
    for (const std::size_t i : seen) problem.centre_ct += landmarks_ct_mm[i] / static_cast<double>(seen.size());
    double sum = 0;
    for (const std::size_t i : seen) sum += (landmarks_ct_mm[i] - problem.centre_ct).squaredNorm();
    problem.radius_mm = std::max(1e-6, std::sqrt(sum / std::max<double>(1, static_cast<double>(seen.size()))));
    check_landmarks(problem, seen);

    constexpr int kStarts = 60;  // about 50 degrees apart: well within the basin of points in space
    const Eigen::Vector3d centre = centre_world(problem);
    std::vector<std::pair<double, RigidTransform>> ends;
    for (const Eigen::Matrix3d& rotation : even_rotations(kStarts)) {
        const auto [end, cost] = refined(problem, {rotation, centre - rotation * problem.centre_ct});
        if (cost < kInfinity) ends.emplace_back(cost, end);
    }
    if (ends.empty()) {
        throw Error("no pose puts the landmarks in front of all sources: do the points belong to these views?");
    }
    std::ranges::sort(ends, {}, [](const auto& end) { return end.first; });
    LandmarkPose pose;
    pose.world_from_ct = ends.front().second;
    measure(problem, pose);
    pose.second_rms_px = kInfinity;
    for (const auto& [cost, end] : ends) {
        if (!is_different(problem, end, pose.world_from_ct)) continue;
        pose.second_rms_px = std::sqrt(cost / static_cast<double>(sightings.size()));
        break;
    }
    return pose;
}

}  // namespace raylign

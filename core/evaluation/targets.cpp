#include "raylign/targets.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "core/base/error.h"
#include "core/base/random.h"

namespace raylign {
using namespace detail;
namespace {

constexpr double kLargestRotationRad = std::numbers::pi / 4;

/// Mean distance of two points' projections on the detector, which lies at depth sdd.
double mean_projection_distance_mm(const ViewGeometry& view, std::span<const Eigen::Vector3d> found_world,
                                   std::span<const Eigen::Vector3d> true_world) {
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    if (!view.camera.sdd_mm) return kNan;
    double sum_mm = 0;
    for (std::size_t i = 0; i < true_world.size(); ++i) {
        const Eigen::Vector3d found = view.camera_from_world * found_world[i];
        const Eigen::Vector3d truth = view.camera_from_world * true_world[i];
        if (!(found.z() > 0 && truth.z() > 0)) return kNan;
        sum_mm += *view.camera.sdd_mm * (found / found.z() - truth / truth.z()).norm();
    }
    return sum_mm / static_cast<double>(true_world.size());
}

/// Mean distance of the true point to the line from the source through the found point.
double mean_reprojection_distance_mm(const ViewGeometry& view, std::span<const Eigen::Vector3d> found_world,
                                     std::span<const Eigen::Vector3d> true_world) {
    const Eigen::Vector3d source_world = source_world_mm(view);
    double sum_mm = 0;
    for (std::size_t i = 0; i < true_world.size(); ++i) {
        const Eigen::Vector3d line = (found_world[i] - source_world).normalized();
        // From the found point, not from the source: the small difference is taken before it is projected.
        sum_mm += (true_world[i] - found_world[i]).cross(line).norm();
    }
    return sum_mm / static_cast<double>(true_world.size());
}

std::vector<Eigen::Vector3d> transformed(const RigidTransform& b_from_a, std::span<const Eigen::Vector3d> points_a) {
    std::vector<Eigen::Vector3d> points_b;
    for (const Eigen::Vector3d& x_a : points_a) points_b.push_back(b_from_a * x_a);
    return points_b;
}

void need_targets(std::span<const Eigen::Vector3d> targets) {
    if (targets.empty()) throw Error("targets: at least one is needed");
}

/// Mean distance of points from an axis through `centre`.
double mean_distance_from_axis_mm(std::span<const Eigen::Vector3d> points_mm, const Eigen::Vector3d& centre_mm,
                                  const Eigen::Vector3d& axis) {
    double sum_mm = 0;
    for (const Eigen::Vector3d& x : points_mm) sum_mm += (x - centre_mm).cross(axis).norm();
    return sum_mm / static_cast<double>(points_mm.size());
}

/// A random twist whose mTRE is near `mtre_mm`, to first order and up to how its two parts add up.
Twist random_twist(std::span<const Eigen::Vector3d> targets_world, const Eigen::Vector3d& centre_world, double mtre_mm,
                   Random& random) {
    const Eigen::Vector3d axis = random.direction(), direction = random.direction();
    const double share = random.uniform();
    const double lever_mm = mean_distance_from_axis_mm(targets_world, centre_world, axis);
    // Compared by products: a lever of zero (one target) divides nothing.
    const bool too_far = share * mtre_mm > kLargestRotationRad * lever_mm || lever_mm == 0;
    const double angle_rad = !too_far ? share * mtre_mm / lever_mm : lever_mm == 0 ? 0 : kLargestRotationRad;
    Twist twist;
    twist << angle_rad * axis, (mtre_mm - angle_rad * lever_mm) * direction;
    return twist;
}

}  // namespace

TargetErrors target_errors(const RigidTransform& found_world_from_ct, const RigidTransform& true_world_from_ct,
                           std::span<const Eigen::Vector3d> targets_ct_mm, std::span<const ViewGeometry> views) {
    need_targets(targets_ct_mm);
    const auto found_world = transformed(found_world_from_ct, targets_ct_mm);
    const auto true_world = transformed(true_world_from_ct, targets_ct_mm);
    TargetErrors errors;
    for (std::size_t i = 0; i < true_world.size(); ++i) {
        errors.tre_mm.push_back((found_world[i] - true_world[i]).norm());
        errors.mtre_mm += errors.tre_mm.back();
    }
    errors.mtre_mm /= static_cast<double>(true_world.size());
    for (const ViewGeometry& view : views) {
        errors.mpd_mm.push_back(mean_projection_distance_mm(view, found_world, true_world));
        errors.mrpd_mm.push_back(mean_reprojection_distance_mm(view, found_world, true_world));
        errors.mean_mrpd_mm += errors.mrpd_mm.back();
    }
    errors.mean_mrpd_mm /= static_cast<double>(views.size());
    return errors;
}

double mean_target_error_mm(const RigidTransform& found_world_from_ct, const RigidTransform& true_world_from_ct,
                            std::span<const Eigen::Vector3d> targets_ct_mm) {
    need_targets(targets_ct_mm);
    double sum_mm = 0;
    for (const Eigen::Vector3d& x_ct : targets_ct_mm) {
        sum_mm += (found_world_from_ct * x_ct - true_world_from_ct * x_ct).norm();
    }
    return sum_mm / static_cast<double>(targets_ct_mm.size());
}

Eigen::Vector3d targets_centre_mm(std::span<const Eigen::Vector3d> targets_mm) {
    need_targets(targets_mm);
    Eigen::Vector3d sum_mm = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& x : targets_mm) sum_mm += x;
    return sum_mm / static_cast<double>(targets_mm.size());
}

RigidTransform perturbed_start(const RigidTransform& true_world_from_ct, std::span<const Eigen::Vector3d> targets_ct_mm,
                               double mtre_mm, std::uint64_t seed) {
    if (!(mtre_mm >= 0 && std::isfinite(mtre_mm))) {
        throw bad_value("mtre_mm", std::to_string(mtre_mm), "finite and not negative", "a perturbed start");
    }
    const Eigen::Vector3d centre_world = true_world_from_ct * targets_centre_mm(targets_ct_mm);
    if (mtre_mm == 0) return true_world_from_ct;
    Random random(seed);
    const Twist twist = random_twist(transformed(true_world_from_ct, targets_ct_mm), centre_world, mtre_mm, random);
    const auto start = [&](double scale) { return exp_about(scale * twist, centre_world) * true_world_from_ct; };
    const auto reaches = [&](double scale) {
        return mean_target_error_mm(start(scale), true_world_from_ct, targets_ct_mm) >= mtre_mm;
    };
    // The mTRE rises with the scale while the angle is below pi, and at scale 2 (90 degrees) it is past what is wanted.
    double low = 0, high = 1;
    while (!reaches(high) && high < 1024) high *= 2;
    for (int i = 0; i < 60; ++i) {
        const double middle = (low + high) / 2;
        (reaches(middle) ? high : low) = middle;
    }
    return start(high);
}

}  // namespace raylign

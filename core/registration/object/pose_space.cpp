#include "core/registration/object/pose_space.h"

#include <cmath>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"

namespace raylign::detail {

ObjectExtent object_extent(const Volume& volume) {
    double mass = 0;
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    const Eigen::Vector3i& n = volume.grid.size;
    for (int z = 0; z < n.z(); ++z) {
        for (int y = 0; y < n.y(); ++y) {
            // Per row first: a sum of positions over 10^8 voxels would lose digits.
            double row_mass = 0, row_first = 0, row_second = 0;
            for (int x = 0; x < n.x(); ++x) {
                const double value = std::abs(volume(x, y, z));
                row_mass += value;
                row_first += value * x;
                row_second += value * x * x;
            }
            const Eigen::Vector3d moment(row_first, row_mass * y, row_mass * z);
            mass += row_mass;
            first += moment;
            second.row(0) += Eigen::RowVector3d(row_second, row_first * y, row_first * z);
            second.row(1) += y * moment.transpose();
            second.row(2) += z * moment.transpose();
        }
    }
    if (!(mass > 0)) throw Error("the volume is empty: no voxel attenuates (wrong preset or --attenuation missing?)");
    const Eigen::Vector3d centre = first / mass;
    // Half a voxel of its own keeps the extent of a single voxel positive.
    const Eigen::Matrix3d variance =
        second / mass - centre * centre.transpose() + Eigen::Matrix3d(Eigen::Vector3d::Constant(1.0 / 12).asDiagonal());
    const Eigen::Matrix3d variance_mm2 =
        volume.grid.spacing_mm.asDiagonal() * variance * volume.grid.spacing_mm.asDiagonal();
    const double thinnest_mm2 = principal_axes(variance_mm2).values[0];
    return {.centre_ct_mm = volume.grid.ct_from_voxel(centre),
            .thickness_mm = std::sqrt(12 * thinnest_mm2),
            .radius_mm = std::sqrt(5.0 / 3 * variance_mm2.trace())};
}

PoseSpace make_pose_space(const RigidTransform& base_world_from_ct, const ObjectExtent& extent) {
    return {base_world_from_ct, base_world_from_ct * extent.centre_ct_mm, extent.radius_mm};
}

RigidTransform PoseSpace::pose(const Eigen::VectorXd& x) const {
    Twist twist;
    twist << x.head<3>() / radius_mm, x.tail<3>();
    return exp_about(twist, centre_world_mm) * base_world_from_ct;
}

double apart_mm(const RigidTransform& a, const RigidTransform& b, const ObjectExtent& extent) {
    const double shift_mm = (a * extent.centre_ct_mm - b * extent.centre_ct_mm).norm();
    return std::hypot(shift_mm, rotation_angle_rad(a * inverse(b)) * extent.radius_mm);
}

}  // namespace raylign::detail

#include "core/registration/object/pose_space.h"

#include <cmath>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"

namespace raylign::detail {

ObjectExtent object_extent(const Volume& volume) { return object_extent(volume_sums(volume), volume.grid); }

ObjectExtent object_extent(const VolumeSums& sums, const VoxelGrid& grid) {
    if (!(sums.mass > 0))
        throw Error("the volume is empty: no voxel attenuates (wrong preset or --attenuation missing?)");
    const Eigen::Vector3d centre = sums.first / sums.mass;
    // Half a voxel of its own keeps the extent of a single voxel positive.
    const Eigen::Matrix3d variance = sums.second / sums.mass - centre * centre.transpose() +
                                     Eigen::Matrix3d(Eigen::Vector3d::Constant(1.0 / 12).asDiagonal());
    const Eigen::Matrix3d variance_mm2 = grid.spacing_mm.asDiagonal() * variance * grid.spacing_mm.asDiagonal();
    const double thinnest_mm2 = principal_axes(variance_mm2).values[0];
    return {.centre_ct_mm = grid.ct_from_voxel(centre),
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

#pragma once

#include <Eigen/Core>

#include "core/registration/object/volume_sums.h"
#include "raylign/rigid_transform.h"
#include "raylign/volume.h"

namespace raylign::detail {

/// Centre and size of what attenuates in a volume.
struct ObjectExtent {
    Eigen::Vector3d centre_ct_mm = Eigen::Vector3d::Zero();  ///< centroid of the attenuation
    double thickness_mm = 1;  ///< of the uniform slab with the variance of the thinnest direction: sqrt(12) rms
    double radius_mm = 1;     ///< of the uniform ball with the same mean squared distance: sqrt(5/3) rms
};
/// Throws Error where no voxel attenuates.
[[nodiscard]] ObjectExtent object_extent(const Volume& volume);
[[nodiscard]] ObjectExtent object_extent(const VolumeSums& sums, const VoxelGrid& grid);

/// Six unitless parameters around a base pose: world_from_ct(x) = exp_about(twist(x), c) * base, where c is the
/// object's centre in world under the base pose and twist(x) = (x_0..2 / radius, x_3..5). One unit moves the object by
/// about 1 mm at its rim, in rotation as in translation.
struct PoseSpace {
    RigidTransform base_world_from_ct;
    Eigen::Vector3d centre_world_mm;
    double radius_mm;

    [[nodiscard]] RigidTransform pose(const Eigen::VectorXd& x) const;
};
[[nodiscard]] PoseSpace make_pose_space(const RigidTransform& base_world_from_ct, const ObjectExtent& extent);

/// How far apart two poses put the object: the length in PoseSpace parameters [mm at the rim].
[[nodiscard]] double apart_mm(const RigidTransform& a, const RigidTransform& b, const ObjectExtent& extent);

}  // namespace raylign::detail

#pragma once

#include "raylign/rigid_transform.h"
#include "raylign/volume.h"

namespace raylign::detail {

/// Adds a volume at a pose of its own to another one: every voxel of `onto` gains the trilinear value of `other` where
/// its centre lies in it. What moved parts of a body show under an X-ray model, which takes one volume. `onto` should
/// not be coarser; what lies beyond its grid is lost.
void add_resampled(Volume& onto, const RigidTransform& onto_world_from_ct, const Volume& other,
                   const RigidTransform& other_world_from_ct);

/// Affine map between the voxel coordinates of two volumes at their poses.
struct PosedMap {
    Eigen::Matrix3d matrix;
    Eigen::Vector3d offset;

    [[nodiscard]] Eigen::Vector3d operator()(const Eigen::Vector3d& voxel) const { return matrix * voxel + offset; }
};
[[nodiscard]] PosedMap posed_map(const VoxelGrid& to, const RigidTransform& to_world_from_ct, const VoxelGrid& from,
                                 const RigidTransform& from_world_from_ct);

/// The voxels of a grid of `size` whose centres can lie in the support of another, (-1, n) voxels per axis; `map` leads
/// from the other's voxels to this grid's. Empty where end <= begin.
[[nodiscard]] VoxelBox reached_voxels(const Eigen::Vector3i& size, const PosedMap& map,
                                      const Eigen::Vector3i& other_size);

}  // namespace raylign::detail

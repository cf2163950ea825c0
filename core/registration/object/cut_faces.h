#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "core/registration/object/volume_sums.h"
#include "raylign/view.h"
#include "raylign/volume.h"

namespace raylign::detail {

/// A side of a volume that cuts through tissue: a CT shows a part of a body, and the X-ray more of it.
struct CutFace {
    int axis = 0;          ///< voxel index that is constant on the face: 0, 1 or 2
    bool is_high = false;  ///< at the last voxel of that axis, not the first
    /// Box around the tissue on the face, in voxels of the next axis and the one after it (cyclic).
    Eigen::Vector2d low_voxel = Eigen::Vector2d::Zero(), high_voxel = Eigen::Vector2d::Zero();
};

/// Faces whose outermost voxels are tissue (more than half of the mean of all that attenuates) to at least 2 %: less
/// is a table or noise.
[[nodiscard]] std::vector<CutFace> cut_faces(const Volume& volume);
[[nodiscard]] std::vector<CutFace> cut_faces(const Volume& volume, const VolumeSums& sums);

/// 1 where the pixel's ray misses all that was cut off, 0 where it meets it: the box of each face drawn out beyond the
/// volume without end. What a 0 shows, no pose of the volume explains. A face that would take more than half of the
/// rays through the tissue behind it is left aside in that view: the view looks through it.
[[nodiscard]] Image within_cut_faces(std::span<const CutFace> faces, const VoxelGrid& grid, const ViewGeometry& view,
                                     const RigidTransform& world_from_ct);

}  // namespace raylign::detail

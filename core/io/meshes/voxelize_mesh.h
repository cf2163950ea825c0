#pragma once

#include <vector>

#include "core/io/meshes/triangle_mesh.h"
#include "raylign/volume.h"

namespace raylign::detail {

/// How much of each voxel a solid fills, in [0, 1].
struct MeshFill {
    std::vector<float> share;  ///< x fastest
    double crossing_mm3 = 0;   ///< where the surface lies in itself or crosses itself: counted once
};

/// The grid around a mesh: axes and coordinates of the mesh, cubes of this side, a voxel of air around it. Throws Error
/// for more than `most_voxels`.
[[nodiscard]] VoxelGrid grid_around(const MeshBounds& bounds, double spacing_mm, double most_voxels);

/// Partial volumes: exact along z, from 25 lines a voxel across it. A point is inside where the surface winds around
/// it, however often and whichever way: what crosses itself is a union. `grid`: axes parallel to the mesh's.
[[nodiscard]] MeshFill voxelize_mesh(const TriangleMesh& mesh, const VoxelGrid& grid);

}  // namespace raylign::detail

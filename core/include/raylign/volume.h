#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "raylign/grid.h"
#include "raylign/surface.h"

namespace raylign {

/// Linear attenuation on a voxel grid. The field is the trilinear interpolant of the lattice padded with zeros:
/// its support is (-1, n) voxels per axis, it is continuous, and a row of n voxels of value v and spacing s integrates
/// to exactly n s v.
struct Volume {
    VoxelGrid grid;
    std::vector<float> attenuation_per_mm;  ///< x fastest, grid.voxel_count() values, finite
    /// The same body exactly, of a model: what DRRs are then made from. Whoever changes voxels takes it away.
    std::shared_ptr<const Surface> surface = nullptr;

    [[nodiscard]] std::size_t index(int x, int y, int z) const {
        return (static_cast<std::size_t>(z) * grid.size.y() + y) * grid.size.x() + x;
    }
    [[nodiscard]] float operator()(int x, int y, int z) const { return attenuation_per_mm[index(x, y, z)]; }
};

/// A label per voxel, on a grid of its own.
struct LabelMap {
    VoxelGrid grid;
    std::vector<std::int32_t> labels;  ///< x fastest, grid.voxel_count() values; 0 = background
};

}  // namespace raylign

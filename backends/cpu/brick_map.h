#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "backends/cpu/workers.h"

namespace raylign::detail::cpu {

/// Which bricks of kBlockVoxels^3 voxels of a volume hold anything but zeros. Everything that is left out later, in
/// memory and along rays, follows from this map.
struct BrickMap {
    int voxels[3];                       ///< the volume's size, in x, y, z order as everything here
    int bricks[3];                       ///< the last ones may be cut short
    std::vector<std::uint8_t> occupied;  ///< 1 where a brick holds a voxel other than 0; x fastest
    /// The voxels that are worth a copy: all occupied bricks lie in [begin, end), whose begins are multiples of
    /// kSlabPlanes, like its ends unless the volume ends there. Empty where the volume is.
    int begin[3], end[3];
    float largest = 0;  ///< |attenuation| [1/mm]

    [[nodiscard]] std::size_t index(int x, int y, int z) const {
        return x + static_cast<std::size_t>(bricks[0]) * (y + static_cast<std::size_t>(bricks[1]) * z);
    }
};

/// Of `size` voxels, x fastest, all of them finite: one pass over them.
[[nodiscard]] BrickMap map_bricks(const float* voxels, const int (&size)[3], Workers& workers);

/// The same size with every brick said to be occupied: what leaving out is compared with.
[[nodiscard]] BrickMap all_occupied(const BrickMap& map);

}  // namespace raylign::detail::cpu

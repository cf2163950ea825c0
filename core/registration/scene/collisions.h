#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "raylign/rigid_transform.h"
#include "raylign/volume.h"

namespace raylign::detail {

/// A rigid object at a pose. The volume is borrowed.
struct PosedVolume {
    const Volume* volume = nullptr;
    RigidTransform world_from_ct;
};

/// Two objects that lie in one another.
struct Collision {
    std::size_t first = 0, second = 0;  ///< positions among the objects, first < second
    std::int64_t voxels = 0;            ///< of the one with the smaller voxels, whose centres lie in the other
    double volume_mm3 = 0;              ///< of these voxels
    double share = 0;                   ///< of the smaller object's volume, in [0, 1]
    double share_of_larger = 0;         ///< the same of the larger one's
};

/// Pairs of objects that share space at these poses: voxels that attenuate, and whose centres fall into a voxel of the
/// other that attenuates. Objects cut from one CT share none where they lie as they did in it; half a voxel of motion
/// makes a layer of them.
[[nodiscard]] std::vector<Collision> collisions(std::span<const PosedVolume> objects);

}  // namespace raylign::detail

#pragma once

#include <vector>

#include "backends/cpu/volume_layouts.h"

namespace raylign::detail::cpu {

/// 19 x 37 x 21: no multiple of a line, a brick or a slab. A ball of noise in air.
struct BallInAir {
    static constexpr int kSize[3] = {19, 37, 21};
    std::vector<float> voxels;

    BallInAir() {
        for (int z = 0; z < kSize[2]; ++z) {
            for (int y = 0; y < kSize[1]; ++y) {
                for (int x = 0; x < kSize[0]; ++x) {
                    const bool inside = (x - 5) * (x - 5) + (y - 26) * (y - 26) + (z - 9) * (z - 9) < 64;
                    voxels.push_back(inside ? 1e-3F * static_cast<float>((x + 19 * y + 703 * z) % 97 - 20) : 0.F);
                }
            }
        }
    }
    [[nodiscard]] VoxelSource source() const {
        return {
            voxels.data(), kFloat32, 1, {1, kSize[0], kSize[0] * kSize[1]}, {0, 0, 0}, {kSize[0], kSize[1], kSize[2]}};
    }
    [[nodiscard]] float at(int x, int y, int z) const {
        if (x < 0 || y < 0 || z < 0 || x >= kSize[0] || y >= kSize[1] || z >= kSize[2]) return 0;
        return voxels[x + kSize[0] * (y + static_cast<std::size_t>(kSize[1]) * z)];
    }
};

/// A map without voxels, as of a volume that is occupied everywhere: for sizes that no test could hold.
inline BrickMap dense_map(int nx, int ny, int nz) {
    BrickMap map{};
    const int size[3] = {nx, ny, nz};
    for (int axis = 0; axis < 3; ++axis) {
        map.voxels[axis] = map.end[axis] = size[axis];
        map.bricks[axis] = size[axis] / kBlockVoxels + (size[axis] % kBlockVoxels != 0 ? 1 : 0);
    }
    map.largest = 0.05F;
    return map;
}

}  // namespace raylign::detail::cpu

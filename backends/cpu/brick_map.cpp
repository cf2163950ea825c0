#include "backends/cpu/brick_map.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>

#include "backends/cpu/kernel_types.h"

namespace raylign::detail::cpu {
namespace {

int bricks(int voxels) { return voxels / kBlockVoxels + (voxels % kBlockVoxels != 0 ? 1 : 0); }

/// largest[x] = the larger of it and |row[x]|, both as bits: without a sign, floats are ordered like integers, whose
/// comparison becomes vectors with no leave to reorder anything.
void add_row(std::int32_t* largest, const float* row, int count) {
    constexpr int kStep = 256;
    std::int32_t bits[kStep];
    for (int x = 0; x < count; x += kStep) {
        const int some = std::min(kStep, count - x);
        std::memcpy(bits, row + x, some * sizeof(float));
        for (int i = 0; i < some; ++i) largest[x + i] = std::max(largest[x + i], bits[i] & 0x7FFFFFFF);
    }
}

void set_box(BrickMap& map) {
    std::fill_n(map.begin, 3, 1 << 30);
    std::fill_n(map.end, 3, 0);
    for (int z = 0; z < map.bricks[2]; ++z) {
        for (int y = 0; y < map.bricks[1]; ++y) {
            for (int x = 0; x < map.bricks[0]; ++x) {
                if (!map.occupied[map.index(x, y, z)]) continue;
                const int at[3] = {x, y, z};
                for (int axis = 0; axis < 3; ++axis) {
                    map.begin[axis] = std::min(map.begin[axis], at[axis] * kBlockVoxels);
                    map.end[axis] = std::max(map.end[axis], at[axis] * kBlockVoxels + 1);
                }
            }
        }
    }
    for (int axis = 0; axis < 3; ++axis) {
        map.begin[axis] = std::min(map.begin[axis], map.end[axis]) / kSlabPlanes * kSlabPlanes;
        const int slabs = (map.end[axis] + kSlabPlanes - 1) / kSlabPlanes;
        map.end[axis] = std::min(slabs * kSlabPlanes, map.voxels[axis]);
    }
}

}  // namespace

BrickMap map_bricks(const float* voxels, const int (&size)[3], Workers& workers) {
    BrickMap map{};
    for (int axis = 0; axis < 3; ++axis) {
        map.voxels[axis] = size[axis];
        map.bricks[axis] = bricks(size[axis]);
    }
    map.occupied.resize(map.index(0, 0, map.bricks[2]));
    std::vector<std::int32_t> largest(map.bricks[2], 0);
    workers.run(map.bricks[2], [&](std::size_t bz, int) {
        std::vector<std::int32_t> row(static_cast<std::size_t>(map.bricks[0]) * kBlockVoxels);
        const int z0 = static_cast<int>(bz) * kBlockVoxels, z1 = std::min(z0 + kBlockVoxels, size[2]);
        for (int by = 0; by < map.bricks[1]; ++by) {
            std::ranges::fill(row, 0);
            for (int z = z0; z < z1; ++z) {
                const int y1 = std::min((by + 1) * kBlockVoxels, size[1]);
                for (int y = by * kBlockVoxels; y < y1; ++y) {
                    add_row(row.data(), voxels + size[0] * (y + static_cast<std::size_t>(size[1]) * z), size[0]);
                }
            }
            for (int bx = 0; bx < map.bricks[0]; ++bx) {
                const auto block = row.begin() + std::ptrdiff_t{bx} * kBlockVoxels;
                const std::int32_t most = *std::max_element(block, block + kBlockVoxels);
                map.occupied[map.index(bx, by, static_cast<int>(bz))] = most != 0;
                largest[bz] = std::max(largest[bz], most);
            }
        }
    });
    map.largest = std::bit_cast<float>(*std::ranges::max_element(largest));
    set_box(map);
    return map;
}

BrickMap all_occupied(const BrickMap& map) {
    BrickMap full = map;
    std::ranges::fill(full.occupied, 1);
    set_box(full);
    return full;
}

}  // namespace raylign::detail::cpu

// The engine's copy of the volume: every voxel in its place, zeros around, and memory that is refused before it is
// asked for.
#include "backends/cpu/volume_layout.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/error.h"

namespace raylign::cpu {
namespace {

/// 19 x 37 x 21: no multiple of a line, a block or a slab. A ball of noise in air.
class CpuLayout : public testing::TestWithParam<VoxelStorage> {
protected:
    static constexpr int kSize[3] = {19, 37, 21};

    CpuLayout() {
        for (int z = 0; z < kSize[2]; ++z) {
            for (int y = 0; y < kSize[1]; ++y) {
                for (int x = 0; x < kSize[0]; ++x) {
                    const bool inside = (x - 5) * (x - 5) + (y - 20) * (y - 20) + (z - 9) * (z - 9) < 64;
                    voxels_.push_back(inside ? 1e-3F * static_cast<float>((x + 19 * y + 703 * z) % 97 - 20) : 0.F);
                }
            }
        }
    }
    [[nodiscard]] VolumeLayout::Source source() const {
        return {voxels_.data(), kFloat32, 1, {1, kSize[0], kSize[0] * kSize[1]}, {kSize[0], kSize[1], kSize[2]}};
    }
    /// What a layout must hold at (plane, row, column).
    [[nodiscard]] float truth(int axis, int plane, int row, int column) const {
        int at[3];
        at[kAxisOrder[axis][0]] = plane;
        at[kAxisOrder[axis][1]] = row;
        at[kAxisOrder[axis][2]] = column;
        for (int i = 0; i < 3; ++i) {
            if (at[i] < 0 || at[i] >= kSize[i]) return 0;
        }
        return voxels_[at[0] + kSize[0] * (at[1] + static_cast<std::size_t>(kSize[1]) * at[2])];
    }
    [[nodiscard]] static float voxel(const PlaneLayout& layout, int plane, int row, int column) {
        const std::ptrdiff_t at = plane * layout.plane_stride + row * layout.row_stride + column;
        return GetParam() == kInt16 ? layout.unit_per_mm * static_cast<const std::int16_t*>(layout.origin)[at]
                                    : static_cast<const float*>(layout.origin)[at];
    }
    void expect_voxels(const PlaneLayout& layout, int axis) const {
        const float tolerance = GetParam() == kInt16 ? 0.501F * layout.unit_per_mm : 0;
        for (int plane = -1; plane < layout.planes + 2; ++plane) {
            for (int row = -kPadVoxels; row < layout.rows + kPadVoxels; ++row) {
                for (int column = -kPadVoxels; column < layout.columns + kPadVoxels; ++column) {
                    ASSERT_LE(std::abs(voxel(layout, plane, row, column) - truth(axis, plane, row, column)), tolerance)
                        << "axis " << axis << " at " << plane << ", " << row << ", " << column;
                }
            }
        }
    }

    std::vector<float> voxels_;
    Workers workers_{2};
};

TEST_P(CpuLayout, HoldsEveryVoxelAndZerosAround) {
    for (int axis = 0; axis < 3; ++axis) {
        expect_voxels(VolumeLayout(source(), axis, GetParam(), workers_).view(), axis);
    }
}

TEST_P(CpuLayout, MadeFromAnotherLayoutIsTheSame) {
    for (int from = 0; from < 3; ++from) {
        const VolumeLayout first(source(), from, GetParam(), workers_);
        for (int axis = 0; axis < 3; ++axis) {
            expect_voxels(VolumeLayout(first.as_source(), axis, GetParam(), workers_).view(), axis);
        }
    }
}

TEST_P(CpuLayout, TheTableCountsOccupiedBlocks) {
    for (int axis = 0; axis < 3; ++axis) {
        const VolumeLayout owner(source(), axis, GetParam(), workers_);
        const PlaneLayout layout = owner.view();
        const int stride = layout.block_columns + 1, table = stride * (layout.block_rows + 1);
        std::vector<std::int32_t> counts((layout.planes + kSlabPlanes - 1) / kSlabPlanes * table);
        for (int plane = 0; plane < layout.planes; ++plane) {
            for (int row = 0; row < layout.rows; ++row) {
                for (int column = 0; column < layout.columns; ++column) {
                    if (voxel(layout, plane, row, column) == 0) continue;
                    counts[plane / kSlabPlanes * table + (row / kBlockVoxels + 1) * stride + column / kBlockVoxels +
                           1] = 1;
                }
            }
        }
        for (std::size_t at = 0; at < counts.size(); ++at) {
            const int row = static_cast<int>(at) % table / stride, column = static_cast<int>(at) % stride;
            if (row > 0 && column > 0) counts[at] += counts[at - 1] + counts[at - stride] - counts[at - stride - 1];
            ASSERT_EQ(layout.occupied[at], counts[at]) << "axis " << axis << ", entry " << at;
        }
    }
}

TEST_P(CpuLayout, AVolumeBeyondTheMemoryIsAnErrorBeforeAnyAllocation) {
    for (const int size : {1 << 16, 1 << 21, 0x7FFFFFFF}) {  // 1 PiB; bytes that wrap around to 0; beyond 64 bits
        VolumeLayout::Source huge = source();
        huge.size[0] = huge.size[1] = huge.size[2] = size;
        for (int axis = 0; axis < 3; ++axis) {
            try {
                const VolumeLayout layout(huge, axis, GetParam(), workers_);
                ADD_FAILURE() << "a layout of " << size << " voxels a side";
            } catch (const Error& error) {
                EXPECT_THAT(error.what(), testing::HasSubstr("memory: the engine's volume needs"));
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Storage, CpuLayout, testing::Values(kFloat32, kInt16),
                         [](const testing::TestParamInfo<VoxelStorage>& test) {
                             return test.param == kInt16 ? "int16" : "float32";
                         });

TEST(PageBuffer, IsZeroAndStartsOnAHugePage) {
    for (const std::size_t bytes : {std::size_t{1}, std::size_t{2} << 20, std::size_t{5000001}}) {
        const PageBuffer buffer(bytes, "a test");
        EXPECT_EQ(reinterpret_cast<std::uintptr_t>(buffer.data()) % (2 << 20), 0U);
        EXPECT_EQ(std::count(static_cast<char*>(buffer.data()), static_cast<char*>(buffer.data()) + bytes, 0),
                  static_cast<std::ptrdiff_t>(bytes));
    }
}

TEST(PageBuffer, MoreThanIsFreeIsAnErrorThatSaysHowMuch) {
    for (const std::size_t bytes : {free_memory() + (std::size_t{1} << 40), SIZE_MAX}) {
        try {
            const PageBuffer buffer(bytes, "a test");
            ADD_FAILURE() << bytes;
        } catch (const Error& error) {
            EXPECT_THAT(error.what(), testing::HasSubstr(std::to_string((bytes >> 20) + 1) + " MiB"));
        }
    }
}

}  // namespace
}  // namespace raylign::cpu

// The backend's copies of the volume: every voxel in its place, zeros around, and no memory for what is empty.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/base/error.h"
#include "layout_scene.h"
#include "tests/support/errors.h"

namespace raylign::detail::cpu {
namespace {

class CpuLayout : public testing::TestWithParam<VoxelStorage> {
protected:
    CpuLayout() {
        const int(&size)[3] = BallInAir::kSize;
        map_ = map_bricks(ball_.voxels.data(), size, workers_);
    }
    [[nodiscard]] VolumeLayouts make(int first_axis) {
        return {ball_.source(), map_, GetParam(), first_axis, workers_};
    }
    /// What a layout must hold at (plane, row, column).
    [[nodiscard]] float truth(int axis, int plane, int row, int column) const {
        int at[3];
        at[kAxisOrder[axis][0]] = plane;
        at[kAxisOrder[axis][1]] = row;
        at[kAxisOrder[axis][2]] = column;
        return ball_.at(at[0], at[1], at[2]);
    }
    [[nodiscard]] static float voxel(const PlaneLayout& layout, int plane, int row, int column) {
        const std::ptrdiff_t at = (plane - layout.begin[0]) * layout.plane_stride +
                                  (row - layout.begin[1]) * layout.row_stride + column - layout.begin[2];
        return GetParam() == kInt16 ? layout.unit_per_mm * static_cast<const std::int16_t*>(layout.origin)[at]
                                    : static_cast<const float*>(layout.origin)[at];
    }
    /// In all that a kernel may read: the box and the padding.
    void expect_voxels(const PlaneLayout& layout, int axis) const {
        const float tolerance = GetParam() == kInt16 ? 0.501F * layout.unit_per_mm : 0;
        constexpr int pad = kPadVoxels;
        for (int plane = layout.begin[0] - pad; plane < layout.end[0] + pad; ++plane) {
            for (int row = layout.begin[1] - pad; row < layout.end[1] + pad; ++row) {
                for (int column = layout.begin[2] - pad; column < layout.end[2] + pad; ++column) {
                    ASSERT_LE(std::abs(voxel(layout, plane, row, column) - truth(axis, plane, row, column)), tolerance)
                        << "axis " << axis << " at " << plane << ", " << row << ", " << column;
                }
            }
        }
    }

    BallInAir ball_;
    Workers workers_{2};
    BrickMap map_;
};

TEST_P(CpuLayout, HoldsEveryVoxelOfTheBoxAndZerosAround) {
    for (int axis = 0; axis < 3; ++axis) {
        const VolumeLayouts layouts = make(axis);
        const PlaneLayout layout = layouts.view(axis);
        const int sizes[3] = {layout.planes, layout.rows, layout.columns};
        for (int i = 0; i < 3; ++i) {
            EXPECT_EQ(sizes[i], BallInAir::kSize[kAxisOrder[axis][i]]);
            EXPECT_EQ(layout.begin[i], map_.begin[kAxisOrder[axis][i]]);
            EXPECT_EQ(layout.end[i], map_.end[kAxisOrder[axis][i]]);
        }
        expect_voxels(layout, axis);
    }
}

TEST_P(CpuLayout, HoldsEveryVoxelWithoutLeavingOutAny) {
    map_ = all_occupied(map_);
    for (int axis = 0; axis < 3; ++axis) expect_voxels(make(axis).view(axis), axis);
}

TEST_P(CpuLayout, MadeFromAnotherCopyIsTheSame) {
    for (int first = 0; first < 3; ++first) {
        VolumeLayouts layouts = make(first);
        for (int axis = 0; axis < 3; ++axis) {
            layouts.make(axis, workers_);
            ASSERT_TRUE(layouts.has(axis));
            expect_voxels(layouts.view(axis), axis);
        }
    }
}

TEST_P(CpuLayout, TwoAxesShareACopy) {
    VolumeLayouts layouts = make(1);
    EXPECT_TRUE(layouts.has(2));
    EXPECT_FALSE(layouts.has(0));
    const std::size_t one = layouts.bytes();
    layouts.make(2, workers_);
    EXPECT_LT(layouts.bytes(), one + 4096) << "a table, no voxels";
    layouts.make(0, workers_);
    EXPECT_GT(layouts.bytes(), 1.5 * one);
    EXPECT_EQ(layouts.description(), std::string(GetParam() == kInt16 ? "int16" : "float32") +
                                         ", 2 copies of 16 x 21 x 21 of 19 x 37 x 21 voxels");
}

TEST_P(CpuLayout, TheTableCountsOccupiedBlocks) {
    for (int axis = 0; axis < 3; ++axis) {
        const VolumeLayouts owner = make(axis);
        const PlaneLayout layout = owner.view(axis);
        const int stride = layout.block_columns + 1, table = stride * (layout.block_rows + 1);
        std::vector<std::int32_t> counts((layout.planes + kSlabPlanes - 1) / kSlabPlanes * table);
        for (int plane = 0; plane < layout.planes; ++plane) {
            for (int row = 0; row < layout.rows; ++row) {
                for (int column = 0; column < layout.columns; ++column) {
                    if (truth(axis, plane, row, column) == 0) continue;
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
    for (const int size : {1 << 16, 1 << 21, 0x7FFFFFF0}) {  // 1 PiB; bytes that wrap around to 0; beyond 64 bits
        for (int axis = 0; axis < 3; ++axis) {
            const std::string message = test::error_of([&] {
                const VolumeLayouts layouts(ball_.source(), dense_map(size, size, size), GetParam(), axis, workers_);
            });
            EXPECT_THAT(message, testing::HasSubstr("memory: the backend's volume needs")) << size;
            EXPECT_THAT(message, testing::HasSubstr("MiB are free")) << size;
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
        EXPECT_THAT(test::error_of([&] { const PageBuffer buffer(bytes, "a test"); }),
                    testing::HasSubstr(std::to_string((bytes >> 20) + 1) + " MiB"));
    }
}

}  // namespace
}  // namespace raylign::detail::cpu

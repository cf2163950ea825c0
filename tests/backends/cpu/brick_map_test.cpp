// The map of what is empty: everything that the backend leaves out follows from it.
#include <gtest/gtest.h>

#include <algorithm>

#include "backends/cpu/brick_map.h"
#include "layout_scene.h"

namespace raylign::detail::cpu {
namespace {

BrickMap map_of(const std::vector<float>& voxels, int nx, int ny, int nz) {
    Workers workers(2);
    const int size[3] = {nx, ny, nz};
    return map_bricks(voxels.data(), size, workers);
}

TEST(BrickMap, ABrickIsOccupiedWhereAVoxelIsNotZero) {
    const BallInAir ball;
    const BrickMap map = map_of(ball.voxels, 19, 37, 21);
    ASSERT_EQ(map.occupied.size(), 3U * 5 * 3);
    for (int bz = 0; bz < 3; ++bz) {
        for (int by = 0; by < 5; ++by) {
            for (int bx = 0; bx < 3; ++bx) {
                bool any = false;
                for (int i = 0; i < 512; ++i) any |= ball.at(8 * bx + i % 8, 8 * by + i / 8 % 8, 8 * bz + i / 64) != 0;
                EXPECT_EQ(map.occupied[map.index(bx, by, bz)] != 0, any) << bx << " " << by << " " << bz;
            }
        }
    }
    EXPECT_EQ(map.largest, *std::ranges::max_element(ball.voxels));
}

TEST(BrickMap, TheBoxHoldsAllOccupiedBricksAndBeginsAtSlabs) {
    const BrickMap map = map_of(BallInAir().voxels, 19, 37, 21);
    // The ball spans x -2..12, y 19..33, z 2..16.
    const int begin[3] = {0, 16, 0}, end[3] = {16, 37, 21};
    EXPECT_TRUE(std::ranges::equal(map.begin, begin));
    EXPECT_TRUE(std::ranges::equal(map.end, end));
}

TEST(BrickMap, ASingleVoxelIsSeenWhereverItIs) {
    for (int at = 0; at < 20 * 9 * 10; at += 7) {
        std::vector<float> voxels(20 * 9 * 10, 0.F);
        voxels[at] = at % 2 ? 1e-40F : -3.F;  // denormal, negative
        const BrickMap map = map_of(voxels, 20, 9, 10);
        EXPECT_EQ(std::ranges::count(map.occupied, 1), 1);
        EXPECT_EQ(map.occupied[map.index(at % 20 / 8, at / 20 % 9 / 8, at / 180 / 8)], 1) << at;
        EXPECT_EQ(map.largest, at % 2 ? 1e-40F : 3.F);
    }
}

TEST(BrickMap, AnEmptyVolumeHasAnEmptyBox) {
    const BrickMap map = map_of(std::vector<float>(20 * 9 * 10, -0.F), 20, 9, 10);
    EXPECT_EQ(std::ranges::count(map.occupied, 0), std::ssize(map.occupied));
    for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(map.begin[axis], map.end[axis]);
    EXPECT_EQ(map.largest, 0);
}

TEST(BrickMap, RowsLongerThanABufferAreSeenWhole) {
    std::vector<float> voxels(1000 * 2, 0.F);
    voxels[1999] = 1;
    const BrickMap map = map_of(voxels, 1000, 2, 1);
    EXPECT_EQ(map.occupied[map.index(124, 0, 0)], 1);
    EXPECT_EQ(std::ranges::count(map.occupied, 1), 1);
}

}  // namespace
}  // namespace raylign::detail::cpu

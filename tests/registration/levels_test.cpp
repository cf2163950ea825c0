#include "core/registration/levels.h"

#include <gtest/gtest.h>

#include "tests/support/scenes.h"

namespace raylign {
namespace {

Volume cube(int n, double spacing_mm) {
    const VoxelGrid grid = centred_grid({n, n, n}, Eigen::Vector3d::Constant(spacing_mm));
    return {grid, std::vector<float>(static_cast<std::size_t>(grid.voxel_count()), 0.02F)};
}

std::vector<LevelPlan> plan(const Volume& volume, const std::vector<View>& views, int levels = 0) {
    return plan_levels(volume, views, {}, object_extent(volume), {}, levels);
}

TEST(Levels, HalveFromTheFinestDownTo32Pixels) {
    const auto levels = plan(cube(128, 1), test::biplane_views(256, 256));
    ASSERT_EQ(levels.size(), 4u);
    for (int i = 0; i < 4; ++i) {
        EXPECT_EQ(levels[i].image_halvings, std::vector<int>(2, 3 - i));
        EXPECT_EQ(levels[i].volume_halvings, 3 - i);  // a pixel is as wide as a voxel here, on every level
        EXPECT_NEAR(levels[i].pixel_at_object_mm, 1 << (3 - i), 0.05);
    }
}

TEST(Levels, TheFilterKeepsItsWidthInMillimetresUntilOnePixel) {
    const auto levels = plan(cube(128, 1), test::biplane_views(256, 256));
    EXPECT_EQ(levels[3].filter.sigma_px, 3);
    EXPECT_EQ(levels[3].filter.radius_px, 9);
    EXPECT_EQ(levels[2].filter.sigma_px, 1.5);
    EXPECT_EQ(levels[0].filter.sigma_px, 1);
    EXPECT_EQ(levels[0].filter.radius_px, 3);
}

TEST(Levels, PixelsFinerThanHalfAVoxelAreNotUsed) {
    const auto levels = plan(cube(64, 1), test::biplane_views(1024, 128));  // pixels of 1/8 mm at the object
    EXPECT_EQ(levels.back().image_halvings, std::vector<int>(2, 2));
    EXPECT_NEAR(levels.back().pixel_at_object_mm, 0.5, 1e-3);
    EXPECT_EQ(levels.back().volume_halvings, 0);
}

TEST(Levels, ASmallImageOrARequestGivesOneLevel) {
    EXPECT_EQ(plan(cube(64, 1), test::biplane_views(40)).size(), 1u);
    EXPECT_EQ(plan(cube(64, 1), test::biplane_views(256), 1).size(), 1u);
    EXPECT_EQ(plan(cube(64, 1), test::biplane_views(256), 2).size(), 2u);
}

}  // namespace
}  // namespace raylign

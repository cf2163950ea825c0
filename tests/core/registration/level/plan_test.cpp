#include <gtest/gtest.h>

#include <optional>

#include "core/registration/level/plan.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

Volume solid_cube(int n, double spacing_mm) {
    const VoxelGrid grid = centred_grid({n, n, n}, Eigen::Vector3d::Constant(spacing_mm));
    return {grid, std::vector<float>(static_cast<std::size_t>(grid.voxel_count()), 0.02F)};
}

std::vector<LevelPlan> plan(const Volume& volume, const std::vector<View>& views, std::optional<int> levels = {}) {
    return plan_levels(volume, views, {}, object_extent(volume), {}, levels);
}

TEST(Levels, HalveFromTheFinestDownTo32Pixels) {
    const auto levels = plan(solid_cube(128, 1), test::biplane_views(256, 256));
    ASSERT_EQ(levels.size(), 4u);
    for (int i = 0; i < 4; ++i) {
        EXPECT_EQ(levels[i].image_halvings, std::vector<int>(2, 3 - i));
        EXPECT_EQ(levels[i].volume_halvings, 3 - i);  // a pixel is as wide as a voxel here, on every level
        EXPECT_NEAR(levels[i].pixel_at_object_mm, 1 << (3 - i), 0.05);
    }
}

TEST(Levels, TheFilterKeepsItsWidthInMillimetresUntilOnePixel) {
    const auto levels = plan(solid_cube(128, 1), test::biplane_views(256, 256));
    ASSERT_EQ(levels.size(), 4u);
    EXPECT_EQ(levels[3].filter.sigma_px, 3);
    EXPECT_EQ(levels[3].filter.radius_px, 9);
    EXPECT_EQ(levels[2].filter.sigma_px, 1.5);
    EXPECT_EQ(levels[0].filter.sigma_px, 1);
    EXPECT_EQ(levels[0].filter.radius_px, 3);
}

TEST(Levels, PixelsFinerThanHalfAVoxelAreNotUsed) {
    const auto levels = plan(solid_cube(64, 1), test::biplane_views(1024, 128));  // pixels of 1/8 mm at the object
    EXPECT_EQ(levels.back().image_halvings, std::vector<int>(2, 2));
    EXPECT_NEAR(levels.back().pixel_at_object_mm, 0.5, 1e-3);
    EXPECT_EQ(levels.back().volume_halvings, 0);
}

TEST(Levels, VoxelsAreHalvedOnceLessWhereAViewSaturates) {
    const Volume fine = solid_cube(256, 0.5);
    auto views = test::biplane_views(256, 256);
    EXPECT_EQ(plan(fine, views).back().volume_halvings, 1);
    views[1].ceiling = 1.2;
    const auto levels = plan(fine, views);
    EXPECT_EQ(levels.back().volume_halvings, 0);
    EXPECT_EQ(levels.front().volume_halvings, std::ssize(levels) - 1);
}

TEST(Levels, CoarseningStopsBeforeTheObjectIsASpeck) {
    Volume rod = solid_cube(64, 1);  // 6 mm thick along x and y, 64 mm long
    for (std::size_t i = 0; i < rod.attenuation_per_mm.size(); ++i) {
        const std::size_t x = i % 64, y = i / 64 % 64;
        if (x < 29 || x > 34 || y < 29 || y > 34) rod.attenuation_per_mm[i] = 0;
    }
    EXPECT_EQ(plan(rod, test::biplane_views(256, 128)).size(), 1u);  // 12 px wide at 0.5 mm, 6 at 1 mm
}

TEST(Levels, CoarseningStopsWhereAMaskLeavesTooFewPixels) {
    auto views = test::biplane_views(256, 256);
    views[1].weights = Image(256, 256, 0);
    for (int y = 100; y < 164; ++y) {
        for (int x = 100; x < 164; ++x) views[1].weights(x, y) = 1;
    }
    // 64 px wide less 2 x 9: 46^2 px; then 32 less 2 x 5 (rounded): 22^2; then 16 less 2 x 3: too few.
    EXPECT_EQ(plan(solid_cube(128, 1), views).size(), 2u);
}

TEST(Levels, ASmallImageOrARequestGivesOneLevel) {
    EXPECT_EQ(plan(solid_cube(64, 1), test::biplane_views(40)).size(), 1u);
    EXPECT_EQ(plan(solid_cube(64, 1), test::biplane_views(256), 1).size(), 1u);
    EXPECT_EQ(plan(solid_cube(64, 1), test::biplane_views(256), 2).size(), 2u);
}

}  // namespace
}  // namespace raylign::detail

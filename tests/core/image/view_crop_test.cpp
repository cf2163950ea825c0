#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/image/view_crop.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

View counting_view() {
    View view{"AP", test::c_arm_view(20, 40), Image(40, 40), Image(40, 40, 1)};
    for (int i = 0; i < 1600; ++i) view.image.pixels[i] = static_cast<float>(i);
    return view;
}

TEST(CropView, KeepsEveryPixelOnItsRay) {
    const View view = counting_view();
    const View cut = crop(view, {{5, 7}, {30, 19}});
    EXPECT_EQ(cut.geometry.camera.size_px, Eigen::Vector2i(25, 12));
    EXPECT_EQ(cut.weights.height, 12);
    EXPECT_EQ(cut.image(3, 2), view.image(8, 9));
    EXPECT_LT((ray_direction_world(cut.geometry, {3, 2}) - ray_direction_world(view.geometry, {8, 9})).norm(), 1e-14);
    EXPECT_EQ(source_world_mm(cut.geometry), source_world_mm(view.geometry));
}

TEST(CropView, WorksWithoutImageAndRefusesBoxesOutside) {
    View view = counting_view();
    view.image = view.weights = {};
    EXPECT_TRUE(crop(view, {{0, 0}, {3, 3}}).image.empty());
    EXPECT_THROW((void)crop(view, {{0, 0}, {41, 3}}), Error);
    EXPECT_THROW((void)crop(view, {{3, 3}, {3, 9}}), Error);
    EXPECT_THROW((void)crop(view, {{-1, 0}, {3, 3}}), Error);
}

TEST(ReachedPixels, HoldTheObjectAndItsMarginOnly) {
    const View view = counting_view();  // 5 mm a pixel at the isocentre
    VoxelGrid grid;
    grid.size = {10, 10, 10};
    grid.spacing_mm = {4, 4, 4};
    grid.origin_mm = {-18, -18, -18};
    const PixelBox box = reached_pixels(view.geometry, grid, {}, 2);
    for (const double z : {-20.0, 20.0}) {
        const Eigen::Vector2d p = project(view.geometry, {0, 0, z});
        EXPECT_LT(box.begin.y() + 1.5, p.y());
        EXPECT_GT(box.end.y() - 2.5, p.y());
    }
    EXPECT_GT(box.begin.minCoeff(), 5);
    EXPECT_LT(box.end.maxCoeff(), 35);
    // Far outside, or behind the source: all pixels, and the caller finds out that nothing is hit.
    EXPECT_EQ(reached_pixels(view.geometry, grid, RigidTransform::translate({0, 0, 900}), 2).end.x(), 40);
    EXPECT_EQ(reached_pixels(view.geometry, grid, RigidTransform::translate({0, 2000, 0}), 2).end.x(), 40);
}

}  // namespace
}  // namespace raylign::detail

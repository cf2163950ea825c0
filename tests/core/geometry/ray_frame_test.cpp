#include <gtest/gtest.h>

#include <cmath>

#include "core/geometry/dominant_axis.h"
#include "core/geometry/ray_frame.h"

namespace raylign::detail {
namespace {

VoxelGrid askew_grid() {
    VoxelGrid grid;
    grid.size = {40, 50, 60};
    grid.spacing_mm = {0.8, 1.25, 2.2};
    grid.origin_mm = {-13, 42, 7};
    grid.direction = exp((Twist() << 0.4, -0.9, 0.3, 0, 0, 0).finished()).rotation;
    grid.direction.col(2) *= -1;  // mirrored
    return grid;
}

ViewGeometry askew_view() {
    ViewGeometry view;
    view.camera = camera_from_pitch({640, 480}, 1100, {0.4, 0.5}, {300.25, 260.75});
    view.camera.intrinsics_px(0, 1) = 3;
    view.camera_from_world = exp((Twist() << 0.4, -1.2, 0.9, 20, -35, 710).finished());
    return view;
}

RigidTransform odd_pose() { return exp((Twist() << -0.3, 0.5, 0.2, 12, 5, -20).finished()); }

TEST(RayFrame, RayOfAProjectedPointPassesThatPointAtItsDepth) {
    const RayFrame frame = make_ray_frame(askew_grid(), askew_view(), odd_pose());
    for (const Eigen::Vector3d& voxel :
         {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(39, 0, 59), Eigen::Vector3d(12.5, 30.25, 7)}) {
        const Eigen::Vector3d x_world = odd_pose() * askew_grid().ct_from_voxel(voxel);
        const Eigen::Vector2d pixel = project(askew_view(), x_world);
        const double depth_mm = (askew_view().camera_from_world * x_world).z();
        const Eigen::Vector3d on_ray = frame.source_voxel + depth_mm * frame.ray_voxel(pixel.x(), pixel.y());
        EXPECT_LT((on_ray - voxel).norm(), 1e-9);  // voxel coordinates near 1000 through inverses
    }
}

TEST(RayFrame, LengthPerDepthIsTheObliquityOfTheRay) {
    const RayFrame frame = make_ray_frame(askew_grid(), askew_view(), odd_pose());
    const Eigen::Vector3d direction_world = ray_direction_world(askew_view(), {50, 400});
    const double cosine = askew_view().camera_from_world.rotation.row(2) * direction_world;
    EXPECT_NEAR(askew_grid().spacing_mm.cwiseProduct(frame.ray_voxel(50, 400)).norm(), 1 / cosine, 1e-12);
}

TEST(RayFrame, EndsAtTheDetectorOrNever) {
    ViewGeometry view = askew_view();
    EXPECT_EQ(make_ray_frame(askew_grid(), view, odd_pose()).depth_max_mm, 1100);
    view.camera.sdd_mm.reset();
    EXPECT_TRUE(std::isinf(make_ray_frame(askew_grid(), view, odd_pose()).depth_max_mm));
}

TEST(RayFrames, AreOrderedByPoseThenView) {
    const ViewGeometry views[] = {askew_view(), view_from_c_arm({.sad_mm = 700,
                                                                 .sdd_mm = 1000,
                                                                 .primary_angle_deg = 0,
                                                                 .secondary_angle_deg = 0,
                                                                 .pixel_pitch_mm = {1, 1},
                                                                 .size_px = {10, 10},
                                                                 .principal_point_px = {}})};
    const RigidTransform poses[] = {{}, odd_pose(), inverse(odd_pose())};
    const auto frames = make_ray_frames(askew_grid(), views, poses);
    ASSERT_EQ(frames.size(), 6U);
    for (std::size_t i = 0; i < 6; ++i) {
        EXPECT_EQ(frames[i].pose, i / 2);
        EXPECT_EQ(frames[i].view, i % 2);
        EXPECT_EQ(frames[i].source_voxel, make_ray_frame(askew_grid(), views[i % 2], poses[i / 2]).source_voxel);
    }
}

TEST(DominantAxis, IsTheLongestWithTiesToTheFirst) {
    EXPECT_EQ(dominant_axis({3, -2, 1}), 0);
    EXPECT_EQ(dominant_axis({1, -2, 1}), 1);
    EXPECT_EQ(dominant_axis({1, -2, -3}), 2);
    EXPECT_EQ(dominant_axis({1, -1, 1}), 0);
    EXPECT_EQ(dominant_axis({0, 1, -1}), 1);
    EXPECT_EQ(dominant_axis({1, 1 + 1e-6, 0}), 0);  // within the bias
    EXPECT_EQ(dominant_axis({1, 1 + 1e-4, 0}), 1);
}

}  // namespace
}  // namespace raylign::detail

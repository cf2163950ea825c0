#include <gtest/gtest.h>

#include "core/base/error.h"
#include "raylign/start.h"

namespace raylign::detail::apps {
namespace {

constexpr double kRoundingMm = 1e-9;  // a few operations on numbers of about 1000

View c_arm_view(double primary_angle_deg) {
    View view;
    view.name = "view";
    view.geometry = view_from_c_arm({.sad_mm = 1000,
                                     .sdd_mm = 1500,
                                     .primary_angle_deg = primary_angle_deg,
                                     .secondary_angle_deg = 0,
                                     .pixel_pitch_mm = {1, 1},
                                     .size_px = {64, 48},
                                     .principal_point_px = {}});
    return view;
}

VoxelGrid grid_away_from_the_origin() {
    return {.size = {10, 20, 30}, .spacing_mm = {1, 2, 3}, .origin_mm = {100, -50, 7}};
}

TEST(DefaultStart, PutsTheCentreWhereTwoViewsMeet) {
    const std::vector<View> views{c_arm_view(0), c_arm_view(90)};
    const VoxelGrid grid = grid_away_from_the_origin();
    const RigidTransform start = default_start(grid, views);
    EXPECT_LT((start * grid.centre_ct_mm()).norm(), kRoundingMm);  // the isocentre
    EXPECT_EQ(start.rotation, Eigen::Matrix3d::Identity());
}

TEST(DefaultStart, FollowsTheRigWhereverItStands) {
    const Eigen::Vector3d shift_mm(30, -20, 400);
    std::vector<View> views{c_arm_view(0), c_arm_view(60)};
    for (View& view : views) {
        view.geometry.camera_from_world = view.geometry.camera_from_world * RigidTransform::translate(-shift_mm);
    }
    const VoxelGrid grid = grid_away_from_the_origin();
    EXPECT_LT((default_start(grid, views) * grid.centre_ct_mm() - shift_mm).norm(), 1e3 * kRoundingMm);
}

TEST(DefaultStart, OfOneViewIsThePointNearestToTheOrigin) {
    const std::vector<View> views{c_arm_view(30)};
    const VoxelGrid grid = grid_away_from_the_origin();
    EXPECT_LT((default_start(grid, views) * grid.centre_ct_mm()).norm(), kRoundingMm);
}

TEST(DefaultStart, AsksForAStartWhereTheWorldIsTheCamera) {
    View view = c_arm_view(0);
    view.geometry.camera_from_world = {};  // the world's origin is the source: depth unknown
    EXPECT_THROW((void)default_start(grid_away_from_the_origin(), std::vector<View>{view}), Error);
}

}  // namespace
}  // namespace raylign::detail::apps

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/registration/object/pose_space.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

TEST(ObjectExtent, OfAUniformBallIsItsCentreAndRadius) {
    const Phantom ball{"ball", {Ellipsoid{RigidTransform::translate({5, -7, 11}), {20, 20, 20}, 0.02}}};
    const ObjectExtent extent = object_extent(voxelise(ball, centred_grid({48, 48, 40}, {1.5, 1.5, 2})));
    EXPECT_LT((extent.centre_ct_mm - Eigen::Vector3d(5, -7, 11)).norm(), 0.05);
    EXPECT_NEAR(extent.thickness_mm, 20 * std::sqrt(12.0 / 5), 0.3);  // variance r^2 / 5 per axis
    EXPECT_NEAR(extent.radius_mm, 20, 0.2);                           // voxels blur the rim by a part of their size
}

TEST(ObjectExtent, OfAnEmptyVolumeIsAnError) {
    Volume air{centred_grid({4, 4, 4}, {1, 1, 1}), std::vector<float>(64, 0.F)};
    EXPECT_THROW((void)object_extent(air), Error);
}

TEST(PoseSpace, ZeroIsTheBasePose) {
    const PoseSpace space = make_pose_space(test::oblique_pose(), {.centre_ct_mm = {10, 20, 30}, .radius_mm = 50});
    EXPECT_TRUE(to_matrix(space.pose(Eigen::VectorXd::Zero(6))).isApprox(to_matrix(test::oblique_pose()), 1e-14));
}

TEST(PoseSpace, OneUnitMovesTheRimByOneMillimetre) {
    const ObjectExtent extent{.centre_ct_mm = {10, 20, 30}, .radius_mm = 50};
    const PoseSpace space = make_pose_space(test::oblique_pose(), extent);
    for (int i = 0; i < 6; ++i) {
        const RigidTransform moved = space.pose(0.01 * Eigen::VectorXd::Unit(6, i));
        double farthest_mm = 0;
        for (int k = 0; k < 6; ++k) {
            const Eigen::Vector3d rim =
                extent.centre_ct_mm + extent.radius_mm * (k < 3 ? 1 : -1) *
                                          (inverse(test::oblique_pose()).rotation * Eigen::Vector3d::Unit(k % 3));
            farthest_mm = std::max(farthest_mm, (moved * rim - test::oblique_pose() * rim).norm());
        }
        EXPECT_NEAR(farthest_mm, 0.01, 1e-6) << "parameter " << i;
    }
}

TEST(PoseSpace, RotationsLeaveTheCentreInPlace) {
    const ObjectExtent extent{.centre_ct_mm = {10, 20, 30}, .radius_mm = 50};
    const PoseSpace space = make_pose_space(test::oblique_pose(), extent);
    const Eigen::VectorXd turn = (Eigen::VectorXd(6) << 30, -20, 10, 0, 0, 0).finished();
    EXPECT_LT((space.pose(turn) * extent.centre_ct_mm - test::oblique_pose() * extent.centre_ct_mm).norm(), 1e-12);
}

}  // namespace
}  // namespace raylign::detail

#include <gtest/gtest.h>

#include "raylign/grid.h"
#include "raylign/rigid_transform.h"

namespace raylign::detail {
namespace {

VoxelGrid odd_grid() {
    VoxelGrid grid;
    grid.size = {4, 5, 6};
    grid.spacing_mm = {0.8, 1.25, 2.2};
    grid.origin_mm = {-13, 42, 7};
    grid.direction = exp((Twist() << 0.4, -0.9, 0.3, 0, 0, 0).finished()).rotation;
    grid.direction.col(1) *= -1;
    return grid;
}

TEST(VoxelGrid, VoxelAndCtCoordinatesRoundTrip) {
    const Eigen::Vector3d voxel(1.5, -2, 7);
    EXPECT_LT((odd_grid().voxel_from_ct(odd_grid().ct_from_voxel(voxel)) - voxel).norm(), 1e-13);
}

TEST(VoxelGrid, FirstVoxelIsAtTheOriginAndStepsFollowTheColumns) {
    const VoxelGrid grid = odd_grid();
    EXPECT_EQ(grid.ct_from_voxel({0, 0, 0}), grid.origin_mm);
    for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d step = grid.ct_from_voxel(Eigen::Vector3d::Unit(axis)) - grid.origin_mm;
        EXPECT_LT((step - grid.spacing_mm[axis] * grid.direction.col(axis)).norm(), 1e-13);
    }
}

TEST(VoxelGrid, CentreIsTheMeanOfItsCorners) {
    const VoxelGrid grid = odd_grid();
    EXPECT_LT((grid.centre_ct_mm() - (grid.ct_from_voxel({0, 0, 0}) + grid.ct_from_voxel({3, 4, 5})) / 2).norm(),
              1e-13);
    EXPECT_EQ(grid.voxel_count(), 120);
}

}  // namespace
}  // namespace raylign::detail

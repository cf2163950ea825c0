#include "core/io/meshes/voxelize_mesh.h"

#include <gmock/gmock.h>

#include <numeric>

#include "tests/support/errors.h"
#include "tests/support/mesh_shapes.h"

namespace raylign::detail {
namespace {

using test::ball_mesh;
using test::box_mesh;
using testing::HasSubstr;

double volume_mm3(const MeshFill& fill, const VoxelGrid& grid) {
    return std::accumulate(fill.share.begin(), fill.share.end(), 0.0) * grid.spacing_mm.prod();
}

float at(const MeshFill& fill, const VoxelGrid& grid, int x, int y, int z) {
    return fill.share[static_cast<std::size_t>((z * grid.size.y() + y) * grid.size.x() + x)];
}

TEST(VoxelizeMesh, ABoxFillsItsVoxelsByTheirShares) {
    VoxelGrid grid;
    grid.size = {6, 6, 6};
    // Voxel x covers [x - 0.5, x + 0.5]. Faces in x and y lie between the lines.
    const MeshFill fill = voxelize_mesh(box_mesh<TriangleMesh>({0.9, 0.7, 1.25}, {4.5, 3.5, 3.6}), grid);
    EXPECT_FLOAT_EQ(at(fill, grid, 2, 2, 2), 1);
    EXPECT_FLOAT_EQ(at(fill, grid, 4, 3, 3), 1);
    EXPECT_FLOAT_EQ(at(fill, grid, 5, 3, 3), 0);
    EXPECT_NEAR(at(fill, grid, 1, 2, 2), 0.6, 1e-6);
    EXPECT_NEAR(at(fill, grid, 2, 1, 2), 0.8, 1e-6);
    EXPECT_NEAR(at(fill, grid, 2, 2, 1), 0.25, 1e-6);
    EXPECT_NEAR(at(fill, grid, 2, 2, 4), 0.1, 1e-6);
    EXPECT_NEAR(at(fill, grid, 1, 1, 1), 0.6 * 0.8 * 0.25, 1e-6);
    EXPECT_EQ(fill.crossing_mm3, 0);
}

TEST(VoxelizeMesh, LinesThroughEdgesAndCornersSlipThroughNothing) {
    VoxelGrid grid;
    grid.size = {8, 8, 8};
    const MeshFill fill = voxelize_mesh(box_mesh<TriangleMesh>({1, 1, 1}, {6, 6, 6}), grid);
    for (int z = 2; z < 6; ++z) {
        for (int y = 2; y < 6; ++y) {
            for (int x = 2; x < 6; ++x) EXPECT_FLOAT_EQ(at(fill, grid, x, y, z), 1) << x << " " << y << " " << z;
        }
    }
}

TEST(VoxelizeMesh, ABallKeepsItsVolumeAtAnySpacing) {
    const TriangleMesh ball = ball_mesh<TriangleMesh>({1.3, -2.1, 0.4}, 10, 40);
    const double right_mm3 = solid_of(ball, "ball").volume_mm3;
    // 25 lines a voxel, weighed alike: the error falls with the spacing, 2e-3 where the radius has three voxels.
    for (const auto& [spacing_mm, share] : {std::pair(0.37, 5e-4), {1.0, 1e-3}, {3.0, 2.5e-3}}) {
        const VoxelGrid grid = grid_around(bounds_of(ball), spacing_mm, 1e9);
        EXPECT_NEAR(volume_mm3(voxelize_mesh(ball, grid), grid), right_mm3, share * right_mm3) << spacing_mm;
    }
}

TEST(VoxelizeMesh, ShellsInOneAnotherAreAUnionAndCavitiesEmpty) {
    VoxelGrid grid;
    grid.size = {22, 12, 12};
    const TriangleMesh two =
        test::joined(box_mesh<TriangleMesh>({1, 1, 1}, {11, 11, 11}), box_mesh<TriangleMesh>({6, 1, 1}, {16, 11, 11}));
    const MeshFill both = voxelize_mesh(two, grid);
    EXPECT_NEAR(volume_mm3(both, grid), 1500, 1e-2);
    EXPECT_NEAR(both.crossing_mm3, 500, 1e-2);
    const TriangleMesh hollow = test::joined(box_mesh<TriangleMesh>({1, 1, 1}, {11, 11, 11}),
                                             test::inside_out(box_mesh<TriangleMesh>({3, 3, 3}, {9, 9, 9})));
    const MeshFill shell = voxelize_mesh(hollow, grid);
    EXPECT_NEAR(volume_mm3(shell, grid), 1000 - 216, 1e-2);
    EXPECT_EQ(at(shell, grid, 6, 6, 6), 0);
    EXPECT_EQ(shell.crossing_mm3, 0);
}

TEST(VoxelizeMesh, TheGridHasAirAroundTheModelAndALimit) {
    const MeshBounds bounds{{1, 2, 3}, {11, 22, 33}};
    const VoxelGrid grid = grid_around(bounds, 0.5, 1e6);
    EXPECT_EQ(grid.size, Eigen::Vector3i(22, 42, 62));
    EXPECT_LT((grid.centre_ct_mm() - Eigen::Vector3d(6, 12, 18)).norm(), 1e-12);
    EXPECT_THAT(test::error_of([&] { (void)grid_around(bounds, 0.01, 1e6); }), HasSubstr("million"));
}

}  // namespace
}  // namespace raylign::detail

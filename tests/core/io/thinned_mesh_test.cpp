#include "core/io/meshes/thinned_mesh.h"

#include <gmock/gmock.h>

#include "core/io/meshes/mesh_edges.h"
#include "tests/support/mesh_shapes.h"

namespace raylign::detail {
namespace {

double volume_mm3(const TriangleMesh& mesh) {
    double six = 0;
    for (const auto& triangle : mesh.triangles) six += six_volumes_mm3(mesh, triangle, {0, 0, 0});
    return six / 6;
}

TEST(ThinnedMesh, AFineBallKeepsItsShapeWithinTheError) {
    constexpr double kError_mm = 0.02;
    const Eigen::Vector3d centre(300, -200, 100);
    const TriangleMesh fine = test::ball_mesh<TriangleMesh>(centre, 20, 200), thin = thinned(fine, kError_mm);
    EXPECT_LT(thin.triangles.size(), fine.triangles.size() / 5);
    EXPECT_THAT(open_loops(thin), testing::IsEmpty());
    // A shell of the error's thickness is 0.3 % of the ball.
    EXPECT_NEAR(volume_mm3(thin) / volume_mm3(fine), 1, 3 * kError_mm / 20);
    for (const auto& triangle : thin.triangles) {
        Eigen::Vector3d middle = Eigen::Vector3d::Zero();
        for (const std::int32_t corner : triangle) middle += thin.vertices_mm[static_cast<std::size_t>(corner)] / 3;
        // Quadrics are means over a corner's planes: a facet's middle may be twice as far off.
        ASSERT_NEAR((middle - centre).norm(), 20, 2.5 * kError_mm);
    }
}

TEST(ThinnedMesh, WhatIsNotTooFineStaysAsItIs) {
    const TriangleMesh box = test::box_mesh<TriangleMesh>({1, 2, 3}, {11, 22, 33}), same = thinned(box, 0.05);
    EXPECT_EQ(same.triangles.size(), 12U);
    EXPECT_NEAR(volume_mm3(same), 6000, 1e-9);
}

}  // namespace
}  // namespace raylign::detail

#include <gmock/gmock.h>

#include <limits>

#include "core/io/meshes/mesh_edges.h"
#include "tests/support/errors.h"
#include "tests/support/mesh_shapes.h"

namespace raylign::detail {
namespace {

using test::ball_mesh;
using test::box_mesh;
using test::error_of;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

const Eigen::Vector3d kLow(1, 2, 3), kHigh(11, 22, 33);

TEST(SolidMesh, ABoxIsAsItIsAndHasItsVolume) {
    const SolidMesh solid = solid_of(test::soup(box_mesh<TriangleMesh>(kLow, kHigh)), "box.stl");
    EXPECT_EQ(solid.mesh.vertices_mm.size(), 8U);
    EXPECT_EQ(solid.mesh.triangles.size(), 12U);
    EXPECT_NEAR(solid.volume_mm3, 6000, 1e-9);
    EXPECT_THAT(solid.notes, IsEmpty());
}

TEST(SolidMesh, VolumeOfABallIsThatOfItsFacets) {
    // The facets of 60 bands lie within the sphere: 0.2 % of its volume is missing.
    const double ball_mm3 = 4.0 / 3 * std::numbers::pi * 1000;
    const SolidMesh solid = solid_of(ball_mesh<TriangleMesh>({5, 6, 7}, 10, 60), "ball.stl");
    EXPECT_LT(solid.volume_mm3, ball_mm3);
    EXPECT_GT(solid.volume_mm3, 0.997 * ball_mm3);
}

TEST(SolidMesh, ASurfaceInsideOutIsTurned) {
    const SolidMesh solid = solid_of(test::inside_out(box_mesh<TriangleMesh>(kLow, kHigh)), "box.stl");
    EXPECT_NEAR(solid.volume_mm3, 6000, 1e-9);
    EXPECT_THAT(solid.notes, Contains(HasSubstr("1 of 1 surfaces were inside out")));
}

TEST(SolidMesh, InvertedTrianglesAreTurnedAsTheirNeighbours) {
    TriangleMesh mesh = ball_mesh<TriangleMesh>({0, 0, 0}, 10, 20);
    const double right_mm3 = solid_of(mesh, "ball.stl").volume_mm3;
    for (const std::size_t i : {7U, 100U, 101U}) std::swap(mesh.triangles[i][0], mesh.triangles[i][1]);
    const SolidMesh solid = solid_of(mesh, "ball.stl");
    EXPECT_NEAR(solid.volume_mm3, right_mm3, 1e-9);
    EXPECT_THAT(solid.notes, Contains(HasSubstr("3 inverted triangles")));
}

TEST(SolidMesh, ACavityFacesInwardsAndStays) {
    const TriangleMesh hollow = test::joined(box_mesh<TriangleMesh>(kLow, kHigh),
                                             test::inside_out(box_mesh<TriangleMesh>({3, 4, 5}, {9, 20, 31})));
    const SolidMesh solid = solid_of(hollow, "hollow.stl");
    EXPECT_NEAR(solid.volume_mm3, 6000 - 6 * 16 * 26, 1e-9);
    EXPECT_THAT(solid.notes, IsEmpty());
}

TEST(SolidMesh, ASmallHoleIsClosedAndNamed) {
    TriangleMesh mesh = ball_mesh<TriangleMesh>({0, 0, 0}, 10, 20);
    const double whole_mm3 = solid_of(mesh, "ball.stl").volume_mm3;
    mesh.triangles.erase(mesh.triangles.begin() + 300);
    const SolidMesh solid = solid_of(mesh, "ball.stl");
    EXPECT_THAT(open_loops(solid.mesh), IsEmpty());
    EXPECT_NEAR(solid.volume_mm3, whole_mm3, 1e-9) << "a triangle is flat: its hole is closed as it was";
    EXPECT_THAT(solid.notes, Contains(HasSubstr("1 hole")));
}

TEST(SolidMesh, CrackedSeamsAreJoined) {
    TriangleMesh mesh = test::soup(ball_mesh<TriangleMesh>({0, 0, 0}, 10, 10));
    for (std::size_t i = 0; i < mesh.vertices_mm.size(); i += 2) mesh.vertices_mm[i].x() += 5e-5;
    const SolidMesh solid = solid_of(mesh, "ball.stl");
    EXPECT_THAT(open_loops(solid.mesh), IsEmpty());
    EXPECT_THAT(solid.notes, Contains(HasSubstr("vertices were joined")));
}

TEST(SolidMesh, AnOpenSurfaceIsRefusedAndItsHoleNamed) {
    TriangleMesh mesh = box_mesh<TriangleMesh>(kLow, kHigh);
    mesh.triangles.resize(10);  // no face at x = 11
    EXPECT_THAT(error_of([&] { (void)solid_of(mesh, "box.stl"); }),
                AllOf(HasSubstr("box.stl"), HasSubstr("open"), HasSubstr("1 hole"), HasSubstr("36")));
}

TEST(SolidMesh, WhatIsNoSurfaceIsRefused) {
    EXPECT_THAT(error_of([] { (void)solid_of({}, "empty.stl"); }), HasSubstr("empty.stl has no triangles"));
    TriangleMesh bad = box_mesh<TriangleMesh>(kLow, kHigh);
    bad.vertices_mm[3].y() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THAT(error_of([&] { (void)solid_of(bad, "bad.stl"); }), AllOf(HasSubstr("triangle 2"), HasSubstr("NaN")));
    TriangleMesh point = box_mesh<TriangleMesh>(kLow, kLow);
    EXPECT_THAT(error_of([&] { (void)solid_of(point, "point.stl"); }), HasSubstr("no triangle with an area"));
    TriangleMesh sheet = box_mesh<TriangleMesh>(kLow, {11, 22, 3});
    EXPECT_THAT(error_of([&] { (void)solid_of(sheet, "sheet.stl"); }), HasSubstr("sheet.stl"));
}

TEST(SolidMesh, AMoebiusStripIsRefused) {
    TriangleMesh strip;
    constexpr int kSteps = 12;
    for (int i = 0; i < kSteps; ++i) {
        const double turn = 2 * std::numbers::pi * i / kSteps, half = turn / 2;
        for (const double side : {-3.0, 3.0}) {
            const double r = 10 + side * std::cos(half);
            strip.vertices_mm.emplace_back(r * std::cos(turn), r * std::sin(turn), side * std::sin(half));
        }
    }
    for (int i = 0; i < kSteps; ++i) {
        const int a = 2 * i, b = 2 * i + 1;
        const bool is_last = i + 1 == kSteps;
        const int c = is_last ? 1 : a + 2, d = is_last ? 0 : b + 2;
        strip.triangles.push_back({a, c, b});
        strip.triangles.push_back({b, c, d});
    }
    EXPECT_THAT(error_of([&] { (void)solid_of(strip, "strip.stl"); }), HasSubstr("one-sided"));
}

}  // namespace
}  // namespace raylign::detail

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/base/random.h"
#include "raylign/phantom.h"

namespace raylign::detail {
namespace {

double mass_mm2(const Volume& volume) {
    double sum = 0;
    for (const float value : volume.attenuation_per_mm) sum += value;
    return sum * volume.grid.spacing_mm.prod();
}

Eigen::Matrix3d oblique() { return exp((Twist() << 0.4, -0.7, 0.5, 0, 0, 0).finished()).rotation; }

Phantom three_solids() {
    const auto at = [](double x, double y, double z) { return RigidTransform{oblique(), {x, y, z}}; };
    return {"three",
            {Box{at(10, -4, 3), {12, 9, 7}, 0.02}, Ellipsoid{at(-12, 5, -3), {8, 11, 15}, 0.03},
             EllipticCylinder{at(0, 0, 0), {9, 6}, 13, -0.01}}};
}

/// Mean over samples, cell by cell and solid by solid, without any shortcut.
double brute_force(const Phantom& phantom, const VoxelGrid& grid, const Eigen::Vector3d& voxel, int n) {
    double sum = 0;
    for (int i = 0; i < n * n * n; ++i) {
        const Eigen::Vector3d index(i % n, i / n % n, i / n / n);
        const Eigen::Vector3d x_ct =
            grid.ct_from_voxel(voxel + (index + Eigen::Vector3d::Constant(0.5)) / n - Eigen::Vector3d::Constant(0.5));
        for (const Solid& solid : phantom.solids) {
            // A point is inside if rays both ways along some direction cut the solid's chord in two.
            const Eigen::Vector3d d = Eigen::Vector3d(0.36, 0.48, 0.8);
            const double front = chord_mm(solid, x_ct, d), back = chord_mm(solid, x_ct, -d);
            const double mu = std::visit([](const auto& s) { return s.attenuation_per_mm; }, solid);
            if (front > 0 && back > 0) sum += mu;
        }
    }
    return sum / (n * n * n);
}

TEST(Voxelise, EqualsTheMeanOverEachCellsSamples) {
    VoxelGrid grid = centred_grid({19, 17, 23}, {2.5, 3.5, 2.0});
    grid.direction = exp((Twist() << -0.2, 0.3, 0.6, 0, 0, 0).finished()).rotation;
    grid.direction.col(1) *= -1;  // mirrored
    grid.origin_mm = -grid.direction * (grid.spacing_mm.cwiseProduct(Eigen::Vector3d(9, 8, 11)));
    const Volume twin = voxelise(three_solids(), grid, 3);
    int partly = 0;
    for (int z = 0; z < 23; ++z) {
        for (int y = 0; y < 17; ++y) {
            for (int x = 0; x < 19; ++x) {
                const double expected = brute_force(three_solids(), grid, Eigen::Vector3d(x, y, z), 3);
                ASSERT_NEAR(twin(x, y, z), expected, 1e-8) << x << " " << y << " " << z;  // float sums of three terms
                partly += expected > 0 && expected < 0.0199;
            }
        }
    }
    EXPECT_GT(partly, 100);
}

TEST(Voxelise, KeepsTheMass) {
    for (const int n : {16, 32, 64}) {
        const VoxelGrid grid = centred_grid({n, n + 3, n - 2}, Eigen::Vector3d(64.0, 70.0, 66.0) / n);
        const double exact = exact_mass_mm2(three_solids());
        // Surface cells A / h^2, each off at random by about its quantum: the sum falls by h^2.5 or faster. Bound: 2 %
        // at 16.
        EXPECT_NEAR(mass_mm2(voxelise(three_solids(), grid, 4)), exact, 0.02 * exact * std::pow(16.0 / n, 2)) << n;
    }
}

TEST(Voxelise, CellsCutByAFaceHoldTheirShare) {
    // Faces at +-4.5 mm of 1-mm voxels with centres at whole numbers are cell borders; at +-4.25, a quarter of the last
    // cell is empty, which 4 samples a side hit exactly.
    const VoxelGrid grid = centred_grid({15, 15, 15}, {1, 1, 1});
    const Volume twin = voxelise({"box", {Box{{}, {4.25, 4.5, 4.5}, 1}}}, grid, 4);
    EXPECT_EQ(twin(7, 7, 7), 1);
    EXPECT_EQ(twin(7 + 4, 7, 7), 0.75F);
    EXPECT_EQ(twin(7 - 4, 7, 7), 0.75F);
    EXPECT_EQ(twin(7, 7 + 4, 7), 1);
    EXPECT_EQ(twin(7, 7 + 5, 7), 0);
    EXPECT_EQ(twin(7 + 5, 7, 7), 0);
}

TEST(Voxelise, SolidOutsideTheGridLeavesItEmpty) {
    const VoxelGrid grid = centred_grid({8, 8, 8}, {1, 1, 1});
    for (const double far_mm : {20.0, 1e9, -1e9}) {
        const Volume twin = voxelise({"far", {Box{RigidTransform::translate({far_mm, 0, 0}), {3, 3, 3}, 1}}}, grid);
        EXPECT_EQ(mass_mm2(twin), 0) << far_mm;
    }
}

TEST(Voxelise, RefusesBadSampleCountsAndGrids) {
    const Phantom phantom = box_phantom({10, 10, 10});
    EXPECT_THROW((void)voxelise(phantom, centred_grid({8, 8, 8}, {1, 1, 1}), 0), Error);
    EXPECT_THROW((void)voxelise(phantom, centred_grid({8, 8, 8}, {1, 1, 1}), 17), Error);
    EXPECT_THROW((void)voxelise(phantom, centred_grid({0, 8, 8}, {1, 1, 1})), Error);
    EXPECT_THROW((void)voxelise(phantom, centred_grid({8, 8, 8}, {1, 0, 1})), Error);
}

TEST(CentredGrid, HasItsCentreAtTheOrigin) {
    const VoxelGrid grid = centred_grid({4, 5, 7}, {1, 2, 3});
    EXPECT_LT(grid.centre_ct_mm().norm(), 1e-14);
}

}  // namespace
}  // namespace raylign::detail

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>

#include "core/base/error.h"
#include "core/evaluation/mismatch.h"
#include "raylign/phantom.h"

namespace raylign::detail {
namespace {

Volume water(int n, double spacing_mm) {
    Volume volume{centred_grid({n, n, n}, Eigen::Vector3d::Constant(spacing_mm)), {}};
    volume.attenuation_per_mm.assign(volume.grid.voxel_count(), 0.02F);
    return volume;
}

double mass(const Volume& volume) {
    double sum = 0;
    for (const float v : volume.attenuation_per_mm) sum += v;
    return sum * volume.grid.spacing_mm.prod();
}

TEST(Rod, ReplacesTheVolumeOfACylinderWithRoundEnds) {
    Volume volume = water(48, 1);
    const double before = mass(volume);
    add_rod(volume, {{-10, 3, 2}, {12, -4, 6}, 4, 0.25});
    const double length = (Eigen::Vector3d(-10, 3, 2) - Eigen::Vector3d(12, -4, 6)).norm();
    const double inside = std::numbers::pi * 16 * length + 4.0 / 3 * std::numbers::pi * 64;
    EXPECT_NEAR(mass(volume) - before, (0.25 - 0.02) * inside, 0.01 * 0.23 * inside);
    EXPECT_FLOAT_EQ(volume(24, 24, 27), 0.25F);  // about the segment's middle
    EXPECT_FLOAT_EQ(volume(2, 2, 2), 0.02F);
}

TEST(Rod, RefusesBadNumbersAndMayLieOutside) {
    Volume volume = water(8, 1);
    EXPECT_THROW(add_rod(volume, {{0, 0, 0}, {1, 0, 0}, 0, 0.2}), Error);
    EXPECT_THROW(add_rod(volume, {{0, 0, 0}, {1, 0, 0}, 1, -1}), Error);
    EXPECT_THROW(add_rod(volume, {{0, std::nan(""), 0}, {1, 0, 0}, 1, 0.2}), Error);
    const double before = mass(volume);
    add_rod(volume, {{100, 0, 0}, {110, 0, 0}, 3, 0.2});
    EXPECT_EQ(mass(volume), before);
}

TEST(Contrast, IsContinuousAndSplitsAtBone) {
    Volume volume{centred_grid({3, 1, 1}, {1, 1, 1}), {0.01F, 0.0237F, 0.04F}};
    change_contrast(volume, {.soft_gain = 0.5, .bone_gain = 2});
    EXPECT_NEAR(volume(0, 0, 0), 0.005, 1e-6);
    EXPECT_NEAR(volume(1, 0, 0), 0.01185, 1e-6);
    EXPECT_NEAR(volume(2, 0, 0), 0.01185 + 2 * (0.04 - 0.0237), 1e-6);
    EXPECT_THROW(change_contrast(volume, {.soft_gain = 0}), Error);
}

TEST(Scatter, LeavesOpenAirAndCompressesThickParts) {
    Image integral(64, 64);
    for (int y = 0; y < 64; ++y) {
        for (int x = 20; x < 44; ++x) integral(x, y) = 4;
    }
    EXPECT_EQ(with_scatter(integral, 0, 5).pixels.size(), integral.pixels.size());
    for (const float v : with_scatter(Image(16, 16), 1, 3).pixels) EXPECT_NEAR(v, 0, 1e-6);
    const Image s = with_scatter(integral, 0.5, 5);
    EXPECT_LT(s(32, 32), 4);
    // In the middle of the block the scatter is a twentieth of the open beam's at least exp(-4).
    EXPECT_GT(s(32, 32), 2);
    EXPECT_NEAR(with_scatter(integral, 0, 5)(32, 32), 4, 1e-5);
    EXPECT_THROW((void)with_scatter(integral, -1, 5), Error);
    EXPECT_THROW((void)with_scatter(integral, 1, 0), Error);
}

}  // namespace
}  // namespace raylign::detail

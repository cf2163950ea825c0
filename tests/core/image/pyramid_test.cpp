#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/random.h"
#include "core/image/pyramid.h"
#include "tests/support/many_threads.h"

namespace raylign::detail {
namespace {

Volume random_volume(const Eigen::Vector3i& size) {
    Volume volume;
    volume.grid.size = size;
    volume.grid.spacing_mm = {0.8, 1.25, 2.2};
    volume.grid.origin_mm = {-13, 42, 7};
    volume.grid.direction = exp((Twist() << 0.4, -0.9, 0.3, 0, 0, 0).finished()).rotation;
    volume.grid.direction.col(0) *= -1;
    Random random(31);
    for (long long i = 0; i < volume.grid.voxel_count(); ++i) {
        volume.attenuation_per_mm.push_back(static_cast<float>(random.uniform()));
    }
    return volume;
}

struct Moments {
    double mass = 0;
    Eigen::Vector3d centre_ct = Eigen::Vector3d::Zero();
};

Moments moments(const Volume& volume) {
    Moments m;
    for (int z = 0; z < volume.grid.size.z(); ++z) {
        for (int y = 0; y < volume.grid.size.y(); ++y) {
            for (int x = 0; x < volume.grid.size.x(); ++x) {
                const double mass = volume(x, y, z) * volume.grid.spacing_mm.prod();
                m.mass += mass;
                m.centre_ct += mass * volume.grid.ct_from_voxel(Eigen::Vector3d(x, y, z));
            }
        }
    }
    m.centre_ct /= m.mass;
    return m;
}

TEST(VolumePyramid, KeepsMassForEvenOddAndFlatSizes) {
    for (const Eigen::Vector3i& size :
         {Eigen::Vector3i(8, 6, 4), Eigen::Vector3i(7, 5, 3), Eigen::Vector3i(8, 5, 1), Eigen::Vector3i(1, 1, 1)}) {
        const Volume fine = random_volume(size), half = half_resolution(fine);
        EXPECT_EQ(half.attenuation_per_mm.size(), static_cast<std::size_t>(half.grid.voxel_count()));
        EXPECT_NEAR(moments(half).mass / moments(fine).mass, 1, 1e-7) << size.transpose();  // float voxels
    }
}

TEST(VolumePyramid, DoesNotDependOnThreads) {
    const Volume fine = random_volume({13, 11, 9});
    EXPECT_EQ(half_resolution(fine, test::all_at_once).attenuation_per_mm, half_resolution(fine).attenuation_per_mm);
}

TEST(VolumePyramid, AVoxelIsTheMeanOfEightOrOfThoseThatAreThere) {
    const Volume fine = random_volume({11, 7, 5}), half = half_resolution(fine);
    for (int z = 0; z < 3; ++z) {
        for (int y = 0; y < 4; ++y) {
            for (int x = 0; x < 6; ++x) {
                double sum = 0;
                for (int i = 0; i < 8; ++i) {
                    const int fx = 2 * x + i % 2, fy = 2 * y + i / 2 % 2, fz = 2 * z + i / 4;
                    if (fx < 11 && fy < 7 && fz < 5) sum += fine(fx, fy, fz);
                }
                ASSERT_EQ(half(x, y, z), static_cast<float>(sum / 8)) << x << " " << y << " " << z;
            }
        }
    }
}

TEST(VolumePyramid, KeepsTheCentreOfMassOfConstantBlocks) {
    // Every voxel of a block has the same value, so nothing moves within blocks: the grids must lie alike.
    Volume fine = random_volume({8, 6, 4});
    for (int z = 0; z < 4; ++z) {
        for (int y = 0; y < 6; ++y) {
            for (int x = 0; x < 8; ++x) fine.attenuation_per_mm[fine.index(x, y, z)] = fine(x & ~1, y & ~1, z & ~1);
        }
    }
    EXPECT_LT((moments(half_resolution(fine)).centre_ct - moments(fine).centre_ct).norm(), 1e-5);
}

TEST(VolumePyramid, PutsVoxelsInTheMiddleOfTheirBlocks) {
    const Volume fine = random_volume({7, 6, 1}), half = half_resolution(fine);
    EXPECT_EQ(half.grid.size, Eigen::Vector3i(4, 3, 1));
    EXPECT_LT((half.grid.spacing_mm - Eigen::Vector3d(1.6, 2.5, 2.2)).norm(), 1e-14);
    const Eigen::Vector3d expected = fine.grid.ct_from_voxel({4.5, 2.5, 0});
    EXPECT_LT((half.grid.ct_from_voxel({2, 1, 0}) - expected).norm(), 1e-12);
    EXPECT_NEAR(half(2, 1, 0), (fine(4, 2, 0) + fine(5, 2, 0) + fine(4, 3, 0) + fine(5, 3, 0)) / 4, 1e-7);
    EXPECT_NEAR(half(3, 0, 0), (fine(6, 0, 0) + fine(6, 1, 0)) / 4, 1e-7);  // padded with zeros
}

View random_view(int width, int height) {
    View view{"v", {camera_from_pitch({width, height}, 1000, {0.4, 0.5}, {3, 2}), {}}, Image(width, height), {}};
    Random random(32);
    for (float& pixel : view.image.pixels) pixel = static_cast<float>(random.uniform());
    return view;
}

TEST(ViewPyramid, AveragesFourPixelsAndDropsOddOnes) {
    const View fine = random_view(9, 7), half = half_resolution(fine);
    EXPECT_EQ(half.image.width, 4);
    EXPECT_EQ(half.image.height, 3);
    EXPECT_EQ(half.geometry.camera.size_px, Eigen::Vector2i(4, 3));
    EXPECT_TRUE(half.weights.empty());
    EXPECT_NEAR(half.image(1, 2), (fine.image(2, 4) + fine.image(3, 4) + fine.image(2, 5) + fine.image(3, 5)) / 4,
                1e-7);
    EXPECT_EQ(half.name, "v");
}

TEST(ViewPyramid, WeighsPixelsByTheirMask) {
    View fine = random_view(4, 4);
    fine.weights = Image(4, 4, 1);
    fine.weights(0, 0) = 0;
    fine.weights(1, 1) = 0.5F;
    for (int i = 0; i < 4; ++i) fine.weights(2 + i % 2, 2 + i / 2) = 0;
    const View half = half_resolution(fine);
    EXPECT_NEAR(half.image(0, 0), (fine.image(1, 0) + fine.image(0, 1) + 0.5 * fine.image(1, 1)) / 2.5, 1e-6);
    EXPECT_NEAR(half.weights(0, 0), 2.5 / 4, 1e-7);
    EXPECT_EQ(half.image(1, 1), 0);
    EXPECT_EQ(half.weights(1, 1), 0);
}

TEST(ViewPyramid, AMaskedNanDoesNotSpread) {
    View fine = random_view(4, 4);
    fine.weights = Image(4, 4, 1);
    fine.weights(1, 0) = 0;
    fine.image(1, 0) = std::numeric_limits<float>::quiet_NaN();
    fine.weights(2, 2) = 0;
    fine.image(2, 2) = std::numeric_limits<float>::infinity();
    const View half = half_resolution(fine);
    for (const float pixel : half.image.pixels) EXPECT_TRUE(std::isfinite(pixel));
    EXPECT_NEAR(half.image(0, 0), (fine.image(0, 0) + fine.image(0, 1) + fine.image(1, 1)) / 3, 1e-6);
}

TEST(ViewPyramid, KeepsWhatAViewIsComparedBy) {
    View fine = random_view(8, 6);
    fine.cost_weight = 3;
    fine.ceiling = 2;
    fine.by_transmission = true;
    const View half = half_resolution(fine);
    EXPECT_EQ(half.cost_weight, 3);
    EXPECT_EQ(half.ceiling, 2);
    EXPECT_TRUE(half.by_transmission);
}

TEST(ViewPyramid, HalvesSoManyTimes) {
    const View fine = random_view(9, 8);
    EXPECT_EQ(halved(fine, 0).image.pixels, fine.image.pixels);
    const View twice = halved(fine, 2), one_by_one = half_resolution(half_resolution(fine));
    EXPECT_EQ(twice.image.pixels, one_by_one.image.pixels);
    EXPECT_EQ(twice.geometry.camera.size_px, Eigen::Vector2i(2, 2));
}

TEST(ViewPyramid, WithoutAnImageHalvesTheCamera) {
    View fine = random_view(8, 6);
    fine.image = {};
    const View half = half_resolution(fine);
    EXPECT_TRUE(half.image.empty());
    EXPECT_EQ(half.geometry.camera.size_px, Eigen::Vector2i(4, 3));
}

}  // namespace
}  // namespace raylign::detail

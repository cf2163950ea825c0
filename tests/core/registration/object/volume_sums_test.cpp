#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/random.h"
#include "core/registration/object/volume_sums.h"
#include "raylign/grid.h"
#include "tests/support/many_threads.h"

namespace raylign::detail {
namespace {

/// Sizes that neither cells nor lanes divide; some voxels below zero.
Volume noise() {
    Volume volume{centred_grid({53, 17, 26}, {1, 1, 1}), {}};
    Random random(17);
    for (std::int64_t i = 0; i < volume.grid.voxel_count(); ++i) {
        volume.attenuation_per_mm.push_back(static_cast<float>(random.uniform(-0.01, 0.05)));
    }
    return volume;
}

template <class Visit>
void for_voxels(const Volume& volume, const Visit& visit) {
    for (int z = 0; z < volume.grid.size.z(); ++z) {
        for (int y = 0; y < volume.grid.size.y(); ++y) {
            for (int x = 0; x < volume.grid.size.x(); ++x) visit(Eigen::Vector3i(x, y, z), volume(x, y, z));
        }
    }
}

constexpr double kOfFloats = 1e-6;  // relative: stretches of a row are added up in floats

TEST(VolumeSums, AreThoseOfEachVoxel) {
    const Volume volume = noise();
    VolumeSums plain;
    for_voxels(volume, [&](const Eigen::Vector3i& at, double v) {
        const Eigen::Vector3d x = at.cast<double>();
        plain.mass += std::abs(v);
        plain.first += std::abs(v) * x;
        plain.second += std::abs(v) * x * x.transpose();
        plain.attenuating += std::max(v, 0.0);
        plain.attenuating_count += v > 0;
    });
    const VolumeSums sums = volume_sums(volume);
    EXPECT_NEAR(sums.mass, plain.mass, kOfFloats * plain.mass);
    EXPECT_LT((sums.first - plain.first).norm(), kOfFloats * plain.first.norm());
    EXPECT_LT((sums.second - plain.second).norm(), kOfFloats * plain.second.norm());
    EXPECT_NEAR(sums.attenuating, plain.attenuating, kOfFloats * plain.attenuating);
    EXPECT_EQ(sums.attenuating_count, plain.attenuating_count);
}

TEST(VolumeSums, DoNotDependOnThreads) {
    const Volume volume = noise();
    const VolumeSums one = volume_sums(volume), many = volume_sums(volume, test::all_at_once);
    EXPECT_EQ(many.mass, one.mass);
    EXPECT_EQ(many.first, one.first);
    EXPECT_EQ(many.second, one.second);
    EXPECT_EQ(many.attenuating, one.attenuating);
    EXPECT_EQ(many.of_cells, one.of_cells);
}

TEST(VolumeSums, EachCellHasItsVoxels) {
    const Volume volume = noise();
    const VolumeSums sums = volume_sums(volume);
    EXPECT_EQ(sums.cell, 5);
    EXPECT_EQ(sums.cells, Eigen::Vector3i(11, 4, 6));
    std::vector<double> plain(sums.of_cells.size());
    for_voxels(volume, [&](const Eigen::Vector3i& at, double v) {
        const Eigen::Vector3i cell = at / sums.cell;
        plain[(cell.z() * sums.cells.y() + cell.y()) * sums.cells.x() + cell.x()] += std::max(v, 0.0);
    });
    for (std::size_t i = 0; i < plain.size(); ++i) EXPECT_NEAR(sums.of_cells[i], plain[i], kOfFloats * plain[i]) << i;
}

TEST(VolumeSums, AVoxelThatIsNotFiniteShowsInTheMass) {
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        for (const std::size_t at : {std::size_t{0}, std::size_t{52}, std::size_t{9000}}) {
            Volume volume = noise();
            volume.attenuation_per_mm[at] = bad;
            EXPECT_FALSE(std::isfinite(volume_sums(volume).mass)) << bad << " in " << at;
        }
    }
}

}  // namespace
}  // namespace raylign::detail

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "raylign/phantom.h"

namespace raylign::detail {
namespace {

double largest(const Volume& volume) { return *std::ranges::max_element(volume.attenuation_per_mm); }

Volume spine_twin(double extent_mm, int n) {
    return voxelise(spine_phantom(Eigen::Vector3d::Constant(extent_mm)),
                    centred_grid({n, n, n}, Eigen::Vector3d::Constant(extent_mm / n)), 2);
}

TEST(Spine, HasSoftTissueCancellousAndCorticalBone) {
    const Volume twin = spine_twin(200, 128);
    const auto count = [&](double from, double to) {
        return std::ranges::count_if(twin.attenuation_per_mm, [&](float v) { return v > from && v < to; });
    };
    EXPECT_GT(count(0.019, 0.0196), 500000);                               // soft
    EXPECT_GT(count(0.026, 0.029), 15000);                                 // cancellous
    EXPECT_GT(count(0.035, 0.08), 5000);                                   // cortical
    EXPECT_GT(*std::ranges::min_element(twin.attenuation_per_mm), -1e-9);  // hollowing never digs below zero
    EXPECT_LT(largest(twin), 0.1);                                         // dense bone, not metal
}

TEST(Spine, StaysWithinItsExtent) {
    for (const Eigen::Vector3d& extent : {Eigen::Vector3d(200, 200, 200), Eigen::Vector3d(160, 160, 160),
                                          Eigen::Vector3d(300, 250, 400), Eigen::Vector3d(90, 120, 60)}) {
        const Volume around = voxelise(spine_phantom(extent), centred_grid({75, 75, 75}, extent / 50), 2);
        int outside = 0;
        for (int z = 0; z < 75; ++z) {
            for (int y = 0; y < 75; ++y) {
                for (int x = 0; x < 75; ++x) {
                    const Eigen::Array3d share = (Eigen::Array3d(x, y, z) - 37).abs() / 50;
                    outside += share.maxCoeff() > 0.52 && around(x, y, z) != 0;
                }
            }
        }
        EXPECT_EQ(outside, 0) << extent.transpose();
    }
}

TEST(Spine, LooksDifferentMirroredTurnedOrShiftedByALevel) {
    const Volume twin = spine_twin(200, 64);
    const auto difference = [&](auto&& other_index) {
        double sum = 0, all = 0;
        for (int z = 0; z < 64; ++z) {
            for (int y = 0; y < 64; ++y) {
                for (int x = 0; x < 64; ++x) {
                    const Eigen::Vector3i o = other_index(x, y, z);
                    if (o.minCoeff() < 0 || o.maxCoeff() > 63) continue;
                    const double a = std::max(0.0, twin(x, y, z) - 0.021),
                                 b = std::max(0.0, twin(o.x(), o.y(), o.z()) - 0.021);
                    sum += std::abs(a - b);
                    all += a + b;
                }
            }
        }
        return sum / all;  // of the bone: 0 = alike, 1 = no overlap
    };
    EXPECT_GT(difference([](int x, int y, int z) { return Eigen::Vector3i(63 - x, y, z); }), 0.2);
    EXPECT_GT(difference([](int x, int y, int z) { return Eigen::Vector3i(x, 63 - y, z); }), 0.5);
    EXPECT_GT(difference([](int x, int y, int z) { return Eigen::Vector3i(63 - x, 63 - y, z); }), 0.5);
    EXPECT_GT(difference([](int x, int y, int z) { return Eigen::Vector3i(63 - x, y, 63 - z); }), 0.2);
    for (const int shift : {11, 12, 13}) {  // one level is 38 mm = 12.2 voxels
        EXPECT_GT(difference([&](int x, int y, int z) { return Eigen::Vector3i(x, y, z + shift); }), 0.2) << shift;
    }
}

TEST(Spine, LiesPosterior) {
    const Volume twin = spine_twin(200, 64);
    double bone = 0, moment_mm = 0;
    for (int z = 0; z < 64; ++z) {
        for (int y = 0; y < 64; ++y) {
            for (int x = 16; x < 48; ++x) {
                const double extra = std::max(0.0, twin(x, y, z) - 0.021);
                bone += extra;
                moment_mm += extra * twin.grid.ct_from_voxel(Eigen::Vector3d(x, y, z)).y();
            }
        }
    }
    EXPECT_GT(moment_mm / bone, 20);
}

TEST(Spine, HasAboutFiveVertebraeIn200Millimetres) {
    const auto solids = [](double x, double y, double z) { return spine_phantom({x, y, z}).solids.size(); };
    // A taller one has more vertebrae; a scaled one the same number; a wider one the same spine in a wider body.
    EXPECT_GT(solids(200, 200, 400), 1.8 * solids(200, 200, 200));
    EXPECT_EQ(solids(100, 100, 100), solids(200, 200, 200));
    EXPECT_EQ(solids(400, 300, 200), solids(200, 200, 200));
    EXPECT_GT(solids(100, 100, 1), 0U);
}

TEST(SpineVertebra, IsWhatItAddsToTheSpine) {
    const Eigen::Vector3d extent = Eigen::Vector3d::Constant(200);
    const Phantom spine = spine_phantom(extent);
    std::size_t solids = 0;
    double lower_mm = -1e9;
    for (int level = 0; level < 5; ++level) {
        const Phantom vertebra = spine_vertebra(extent, level);
        solids += vertebra.solids.size();
        EXPECT_GT(exact_mass_mm2(vertebra), 300);  // some 35 ml of bone, 0.01 / mm above soft tissue
        const double height_mm = std::visit([](const auto& solid) { return solid.ct_from_solid.translation_mm.z(); },
                                            vertebra.solids.front());
        EXPECT_GT(height_mm, lower_mm + 30);
        lower_mm = height_mm;
    }
    EXPECT_LT(solids, spine.solids.size());
    EXPECT_THROW((void)spine_vertebra(extent, 5), Error);
    EXPECT_THROW((void)spine_vertebra(extent, -1), Error);
}

}  // namespace
}  // namespace raylign::detail

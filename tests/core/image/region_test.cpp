#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <string>

#include "core/base/error.h"
#include "core/image/region.h"
#include "tests/support/errors.h"

namespace raylign::detail {
namespace {

using test::error_of;
using testing::AllOf;
using testing::HasSubstr;

/// 6 x 5 x 4 voxels of the values 1, 2, 3, ... on an oblique grid of three different spacings.
Volume counting_volume() {
    Volume volume;
    volume.grid.size = {6, 5, 4};
    volume.grid.spacing_mm = {0.5, 2, 3};
    volume.grid.origin_mm = {10, -20, 30};
    volume.grid.direction << 0, -1, 0, 0.6, 0, -0.8, 0.8, 0, 0.6;
    volume.attenuation_per_mm.resize(120);
    std::iota(volume.attenuation_per_mm.begin(), volume.attenuation_per_mm.end(), 1.0F);
    return volume;
}

/// The same voxels on axes of LPS.
Volume straight_volume() {
    Volume volume = counting_volume();
    volume.grid.direction.setIdentity();
    return volume;
}

double sum_of(const Volume& volume) {
    return std::accumulate(volume.attenuation_per_mm.begin(), volume.attenuation_per_mm.end(), 0.0);
}

TEST(Crop, VoxelsKeepTheirPlaceAndValue) {
    const Volume volume = counting_volume();
    const Volume part = crop(volume, {{1, 2, 0}, {5, 4, 3}});
    ASSERT_EQ(part.grid.size, Eigen::Vector3i(4, 2, 3));
    ASSERT_EQ(part.attenuation_per_mm.size(), 24U);
    for (int z = 0; z < 3; ++z) {
        for (int y = 0; y < 2; ++y) {
            for (int x = 0; x < 4; ++x) {
                EXPECT_EQ(part(x, y, z), volume(x + 1, y + 2, z));
                const Eigen::Vector3d moved = part.grid.ct_from_voxel(Eigen::Vector3d(x, y, z)) -
                                              volume.grid.ct_from_voxel(Eigen::Vector3d(x + 1, y + 2, z));
                EXPECT_LT(moved.norm(), 1e-12);
            }
        }
    }
}

TEST(Crop, BoxMustNotBeEmptyOrReachBeyondTheGrid) {
    const Volume volume = counting_volume();
    EXPECT_THROW((void)crop(volume, {{0, 0, 0}, {7, 5, 4}}), Error);
    EXPECT_THROW((void)crop(volume, {{-1, 0, 0}, {6, 5, 4}}), Error);
    EXPECT_THROW((void)crop(volume, {{2, 2, 2}, {2, 3, 3}}), Error);
    EXPECT_THROW((void)crop(volume, {{3, 2, 2}, {2, 3, 3}}), Error);
}

TEST(BoxOfObject, HoldsEveryVoxelThatIsNotZeroAndNoMore) {
    Volume volume = counting_volume();
    for (float& voxel : volume.attenuation_per_mm) voxel = 0;
    volume.attenuation_per_mm[volume.index(1, 3, 2)] = 1;
    volume.attenuation_per_mm[volume.index(4, 2, 2)] = -1;
    const VoxelBox box = box_of_object(volume);
    EXPECT_EQ(box.begin, Eigen::Vector3i(1, 2, 2));
    EXPECT_EQ(box.end, Eigen::Vector3i(5, 4, 3));
}

TEST(BoxOfObject, AnEmptyVolumeIsAnError) {
    Volume volume = counting_volume();
    for (float& voxel : volume.attenuation_per_mm) voxel = 0;
    EXPECT_THAT(error_of([&] { (void)box_of_object(volume); }), HasSubstr("0 everywhere"));
}

TEST(ClipAbove, LowersWhatIsAbove) {
    Volume volume = counting_volume();
    clip_above(volume, 50);
    EXPECT_EQ(volume.attenuation_per_mm[48], 49);
    EXPECT_EQ(volume.attenuation_per_mm[119], 50);
}

TEST(KeepInside, JudgesVoxelCentresInCtMillimetres) {
    Volume volume = counting_volume();
    const Volume before = volume;
    const Eigen::Vector3d low(4, -22, 30), high(8, -19, 33);
    keep_inside(volume, {low, high});
    int kept = 0;
    for (int z = 0; z < 4; ++z) {
        for (int y = 0; y < 5; ++y) {
            for (int x = 0; x < 6; ++x) {
                const Eigen::Vector3d at = volume.grid.ct_from_voxel(Eigen::Vector3d(x, y, z));
                const bool is_in = (at.array() >= low.array()).all() && (at.array() <= high.array()).all();
                EXPECT_EQ(volume(x, y, z), is_in ? before(x, y, z) : 0);
                kept += is_in;
            }
        }
    }
    EXPECT_GT(kept, 5);
}

TEST(KeepInside, ABoxOutsideOrUpsideDownIsAnError) {
    Volume volume = straight_volume();
    EXPECT_THAT(error_of([&] { keep_inside(volume, {{100, 0, 0}, {200, 1, 1}}); }), HasSubstr("no voxel's centre"));
    EXPECT_THAT(error_of([&] { keep_inside(volume, {{12, -20, 30}, {11, 0, 40}}); }), HasSubstr("at most"));
    EXPECT_THROW(keep_inside(volume, {{NAN, 0, 0}, {200, 1, 1}}), Error);
}

TEST(KeepLabels, OnTheSameGridKeepsExactlyTheVoxelsOfTheLabel) {
    Volume volume = counting_volume();
    LabelMap map{volume.grid, std::vector<std::int32_t>(120)};
    for (std::size_t i = 0; i < 120; ++i) map.labels[i] = static_cast<std::int32_t>(i % 3);
    const std::vector<std::int32_t> kept{2};
    keep_labels(volume, map, kept);
    for (std::size_t i = 0; i < 120; ++i) {
        EXPECT_EQ(volume.attenuation_per_mm[i], i % 3 == 2 ? static_cast<float>(i + 1) : 0) << i;
    }
}

TEST(KeepLabels, OnAFinerTurnedGridTheNearestLabelDecides) {
    Volume volume = straight_volume();
    // Axes swapped (x of the map is z of the volume), half the spacing: voxel (x, y, z) is the map's (2 z, 2 y, 2 x).
    LabelMap map;
    map.grid.size = {7, 9, 11};
    map.grid.spacing_mm = {1.5, 1, 0.25};
    map.grid.origin_mm = volume.grid.origin_mm + Eigen::Vector3d(0.1, -0.4, 0.6);  // less than half a map voxel
    map.grid.direction << 0, 0, 1, 0, 1, 0, 1, 0, 0;
    map.labels.assign(7 * 9 * 11, 0);
    map.labels[(2 * 3 * 9 + 2 * 2) * 7 + 2 * 1] = 5;  // voxel (3, 2, 1)
    const float value = volume(3, 2, 1);
    const std::vector<std::int32_t> kept{5};
    keep_labels(volume, map, kept);
    EXPECT_EQ(volume(3, 2, 1), value);
    EXPECT_EQ(sum_of(volume), value);
}

TEST(KeepLabels, AnAbsentLabelListsThosePresent) {
    Volume volume = counting_volume();
    LabelMap map{volume.grid, std::vector<std::int32_t>(120, 7)};
    map.labels[0] = 9;
    EXPECT_THAT(error_of([&] { keep_labels(volume, map, std::vector<std::int32_t>{4}); }),
                AllOf(HasSubstr("label = 4"), HasSubstr("7, 9")));
    EXPECT_THAT(error_of([&] { keep_labels(volume, map, std::vector<std::int32_t>{0}); }), HasSubstr("label = 0"));
    map.grid.origin_mm.x() += 1000;
    EXPECT_THAT(error_of([&] { keep_labels(volume, map, std::vector<std::int32_t>{7}); }), HasSubstr("do not overlap"));
}

TEST(ContrastAbove, KeepsWhatExceedsAndHasNoJump) {
    Volume volume{{}, {0.01F, 0.02F, 0.0201F, 0.05F}};
    volume.grid.size = {4, 1, 1};
    contrast_above(volume, 0.02F);
    EXPECT_EQ(volume(0, 0, 0), 0);
    EXPECT_EQ(volume(1, 0, 0), 0);
    EXPECT_NEAR(volume(2, 0, 0), 0.0001, 1e-8);
    EXPECT_NEAR(volume(3, 0, 0), 0.03, 1e-8);
}

TEST(Fade, FallsLinearlyTowardsTheFacesOnly) {
    Volume volume{{}, std::vector<float>(11 * 11 * 11, 1.F)};
    volume.grid.size = {11, 11, 11};
    volume.grid.spacing_mm = {2, 2, 2};
    Volume by_sides = volume;
    fade_faces(volume, {{-1, -1, -1}, {21, 21, 21}}, 4);  // the outer sides of the outermost voxels
    EXPECT_EQ(volume(5, 5, 5), 1);
    EXPECT_NEAR(volume(0, 5, 5), 0.25, 1e-6);
    EXPECT_NEAR(volume(5, 5, 9), 0.75, 1e-6);
    EXPECT_NEAR(volume(0, 10, 5), 0.0625, 1e-6);
    fade_sides(by_sides, 4);
    for (std::size_t i = 0; i < volume.attenuation_per_mm.size(); ++i) {
        ASSERT_NEAR(by_sides.attenuation_per_mm[i], volume.attenuation_per_mm[i], 1e-6);
    }
    EXPECT_THROW(fade_sides(volume, 0), Error);
}

}  // namespace
}  // namespace raylign::detail

#include <gtest/gtest.h>

#include "core/registration/object/continued.h"
#include "core/registration/object/cut_faces.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

/// A column of tissue along z in the middle of a grid, from `low` to below `high` of 40 voxels of 2 mm.
Volume column(int low, int high) {
    Volume volume{centred_grid({40, 40, 40}, {2, 2, 2}), std::vector<float>(std::size_t{40} * 40 * 40)};
    for (int z = low; z < high; ++z) {
        for (int y = 12; y < 28; ++y) {
            for (int x = 10; x < 30; ++x) volume.attenuation_per_mm[volume.index(x, y, z)] = 0.02F;
        }
    }
    return volume;
}

double share_of_zeros(const Image& image, int first_row, int last_row) {
    double zeros = 0, all = 0;
    for (int y = first_row; y < last_row; ++y) {
        for (int x = 0; x < image.width; ++x, ++all) zeros += image(x, y) == 0;
    }
    return zeros / all;
}

TEST(CutFaces, AreWhereTissueReachesTheSide) {
    EXPECT_TRUE(cut_faces(column(1, 39)).empty()) << "an object with air around it is whole";
    const std::vector<CutFace> faces = cut_faces(column(1, 40));
    ASSERT_EQ(faces.size(), 1u);
    EXPECT_EQ(faces[0].axis, 2);
    EXPECT_TRUE(faces[0].is_high);
    EXPECT_EQ(faces[0].low_voxel, Eigen::Vector2d(10, 12));
    EXPECT_EQ(faces[0].high_voxel, Eigen::Vector2d(29, 27));
    EXPECT_EQ(cut_faces(column(0, 40)).size(), 2u);
}

TEST(CutFaces, ASpeckOnASideIsNone) {
    Volume volume = column(1, 39);
    for (int i = 0; i < 20; ++i) volume.attenuation_per_mm[volume.index(5 + i, 3, 0)] = 0.02F;
    EXPECT_TRUE(cut_faces(volume).empty()) << "20 of 1600 voxels";
}

TEST(CutFaces, HideTheRaysThatMeetWhatWasCutOff) {
    const Volume volume = column(1, 40);
    const ViewGeometry view = test::c_arm_view(0, 64);  // rows run to the feet: the head's side is on top
    const Image within = within_cut_faces(cut_faces(volume), volume.grid, view, {});
    // 200 mm are 64 pixels; the face lies 40 mm above the middle, its tissue 40 mm wide.
    EXPECT_EQ(within(32, 10), 0) << "above the face";
    EXPECT_EQ(within(32, 32), 1) << "the column";
    EXPECT_EQ(within(32, 60), 1) << "below it: air that the CT shows as well";
    EXPECT_EQ(within(4, 10), 1) << "beside what was cut off";
    EXPECT_GT(share_of_zeros(within, 0, 16), 0.15);
    EXPECT_EQ(share_of_zeros(within, 24, 64), 0);
}

TEST(CutFaces, FollowThePose) {
    const Volume volume = column(1, 40);
    const ViewGeometry view = test::c_arm_view(0, 64);
    const Image lower = within_cut_faces(cut_faces(volume), volume.grid, view, RigidTransform::translate({0, 0, -40}));
    EXPECT_EQ(lower(32, 28), 0);
    EXPECT_EQ(lower(32, 45), 1);
}

TEST(CutFaces, AreLeftAsideWhereTheViewLooksThroughThem) {
    Volume volume = column(1, 39);
    for (int z = 1; z < 39; ++z) {
        for (int y = 12; y < 28; ++y) {
            for (int x = 0; x < 40; ++x) volume.attenuation_per_mm[volume.index(x, y, z)] = 0.02F;
        }
    }
    ASSERT_EQ(cut_faces(volume).size(), 2u) << "both sides along x";
    const Image lateral = within_cut_faces(cut_faces(volume), volume.grid, test::c_arm_view(90, 64), {});
    EXPECT_EQ(share_of_zeros(lateral, 0, 64), 0) << "every ray of the object meets both";
    EXPECT_GT(share_of_zeros(within_cut_faces(cut_faces(volume), volume.grid, test::c_arm_view(0, 64), {}), 0, 64),
              0.1);
}

TEST(Continued, RepeatsTheOutermostPlaneBeyondTheCut) {
    const Volume volume = column(1, 40);
    const Volume longer = continued(volume, cut_faces(volume), 25);
    EXPECT_EQ(longer.grid.size, Eigen::Vector3i(40, 40, 53)) << "13 planes of 2 mm";
    EXPECT_EQ(longer.grid.origin_mm, volume.grid.origin_mm);
    EXPECT_EQ(longer(20, 20, 39), 0.02F);
    EXPECT_EQ(longer(20, 20, 52), 0.02F);
    EXPECT_EQ(longer(2, 20, 52), 0);
    EXPECT_EQ(longer(20, 20, 0), 0);
}

TEST(Continued, GoesOnBelowTheFirstPlaneWithoutMovingTheRest) {
    const Volume volume = column(0, 39);
    const Volume longer = continued(volume, cut_faces(volume), 10);
    EXPECT_EQ(longer.grid.size.z(), 45);
    EXPECT_EQ(longer.grid.origin_mm.z(), volume.grid.origin_mm.z() - 10);
    EXPECT_EQ(longer(20, 20, 0), 0.02F);
    EXPECT_EQ(longer(20, 20, 44), 0) << "air at the other end";
}

TEST(Continued, PassesOverAPlaneThatHalvingMixedWithAir) {
    Volume volume = column(1, 40);
    for (int i = 0; i < 40 * 40; ++i) volume.attenuation_per_mm[volume.index(0, 0, 39) + i] *= 0.6F;
    EXPECT_EQ(continued(volume, cut_faces(volume), 4)(20, 20, 39), 0.02F);
    EXPECT_EQ(continued(volume, cut_faces(volume), 4)(20, 20, 41), 0.02F);
}

}  // namespace
}  // namespace raylign::detail

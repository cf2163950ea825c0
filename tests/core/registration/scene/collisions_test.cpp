#include "core/registration/scene/collisions.h"

#include <gtest/gtest.h>

#include "raylign/volume.h"

namespace raylign::detail {
namespace {

/// A cube of ten voxels a side.
Volume cube_of_voxels(const Eigen::Vector3d& spacing_mm) {
    Volume volume;
    volume.grid = {{10, 10, 10}, spacing_mm};
    volume.attenuation_per_mm.assign(1000, 0.02F);
    return volume;
}

}  // namespace

TEST(Collisions, AreWhatTwoObjectsShare) {
    const Volume large = cube_of_voxels({2, 2, 2}), small = cube_of_voxels({1, 1, 1});
    // The small one's voxels reach from 14.5 to 24.5 mm along x, the large one's from -1 to 19 mm.
    const std::vector<PosedVolume> objects{{&large, {}}, {&small, RigidTransform::translate({15, 4, 4})}};
    const std::vector<Collision> found = collisions(objects);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].first, 0U);
    EXPECT_EQ(found[0].second, 1U);
    EXPECT_EQ(found[0].voxels, 4 * 10 * 10);  // x = 15, 16, 17, 18; those at 19 lie beyond its last voxel's side
    EXPECT_NEAR(found[0].volume_mm3, 400, 1e-9);
    EXPECT_NEAR(found[0].share, 0.4, 1e-12);
}

TEST(Collisions, ThereAreNoneBesideEachOtherOrWhereNothingAttenuates) {
    const Volume whole = cube_of_voxels({1, 1, 1});
    Volume hollow = whole;
    hollow.attenuation_per_mm.assign(1000, 0);
    hollow.attenuation_per_mm[0] = 0.02F;
    const RigidTransform away = RigidTransform::translate({5, 5, 5});
    EXPECT_EQ(
        collisions(std::vector<PosedVolume>{{&whole, {}}, {&whole, RigidTransform::translate({10, 0, 0})}}).size(), 0U);
    EXPECT_EQ(collisions(std::vector<PosedVolume>{{&whole, away}, {&hollow, {}}}).size(), 0U);
    EXPECT_EQ(collisions(std::vector<PosedVolume>{{&whole, {}}, {&hollow, {}}}).at(0).voxels, 1);
}

TEST(Collisions, TurnWithTheObjects) {
    const Volume whole = cube_of_voxels({1, 1, 1});
    const RigidTransform pose = exp_about((Twist() << 0.3, -0.7, 0.4, 30, -20, 10).finished(), {1, 2, 3});
    const std::vector<PosedVolume> objects{{&whole, pose}, {&whole, pose * RigidTransform::translate({0, 0, 7})}};
    const std::vector<Collision> found = collisions(objects);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].voxels, 300);
}

}  // namespace raylign::detail

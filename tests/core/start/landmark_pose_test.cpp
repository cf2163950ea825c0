#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "core/base/random.h"
#include "raylign/start.h"
#include "tests/support/errors.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

using test::error_of;
using testing::HasSubstr;

const std::vector<ViewGeometry> kViews{test::c_arm_view(20, 512, 200, 10), test::c_arm_view(110, 512)};

/// Points in a bone of 80 mm, off the ct's origin.
std::vector<Eigen::Vector3d> points(int count, std::uint64_t seed) {
    Random random(seed);
    std::vector<Eigen::Vector3d> list;
    for (int i = 0; i < count; ++i) {
        list.emplace_back(100 + random.uniform(-40, 40), -30 + random.uniform(-40, 40), random.uniform(-40, 40));
    }
    return list;
}

/// A pose turned by any angle, with the points near the isocentre.
RigidTransform any_pose(std::uint64_t seed) {
    Random random(seed);
    Twist twist;
    twist << random.direction() * random.uniform(0, std::numbers::pi), random.uniform(-20, 20), random.uniform(-20, 20),
        random.uniform(-20, 20);
    return exp_about(twist, Eigen::Vector3d::Zero()) * RigidTransform::translate({-100, 30, 0});
}

std::vector<LandmarkSighting> sightings(const std::vector<Eigen::Vector3d>& list, const RigidTransform& world_from_ct,
                                        std::size_t views, double noise_px = 0) {
    Random random(5);
    std::vector<LandmarkSighting> seen;
    for (std::size_t v = 0; v < views; ++v) {
        for (std::size_t i = 0; i < list.size(); ++i) {
            const Eigen::Vector2d noise(noise_px * random.normal(), noise_px * random.normal());
            seen.push_back({i, v, project(kViews[v], world_from_ct * list[i]) + noise});
        }
    }
    return seen;
}

double worst_mm(const std::vector<Eigen::Vector3d>& list, const RigidTransform& a, const RigidTransform& b) {
    double worst = 0;
    for (const Eigen::Vector3d& p : list) worst = std::max(worst, (a * p - b * p).norm());
    return worst;
}

TEST(LandmarkPose, SixExactPointsInOneViewGiveThePoseWithoutAStart) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        const auto list = points(6, seed);
        const RigidTransform truth = any_pose(seed + 100);
        const LandmarkPose pose = pose_from_landmarks(list, kViews, sightings(list, truth, 1));
        EXPECT_LT(worst_mm(list, pose.world_from_ct, truth), 1e-4) << "seed " << seed;
        EXPECT_LT(pose.rms_px, 1e-6);
    }
}

TEST(LandmarkPose, FourExactPointsInTwoViewsDo) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        const auto list = points(4, seed);
        const RigidTransform truth = any_pose(seed + 100);
        const LandmarkPose pose = pose_from_landmarks(list, kViews, sightings(list, truth, 2));
        EXPECT_LT(worst_mm(list, pose.world_from_ct, truth), 1e-4) << "seed " << seed;
        EXPECT_EQ(pose.residuals_px.size(), 8U);
    }
}

TEST(LandmarkPose, PointsInAPlaneAreNoSpecialCase) {
    auto list = points(6, 3);
    for (Eigen::Vector3d& p : list) p.z() = 0.3 * p.x();
    const RigidTransform truth = any_pose(7);
    const LandmarkPose pose = pose_from_landmarks(list, kViews, sightings(list, truth, 2));
    EXPECT_LT(worst_mm(list, pose.world_from_ct, truth), 1e-4);
}

TEST(LandmarkPose, NoiseOfAPixelCostsLessThanAMillimetreInTwoViews) {
    const auto list = points(8, 4);
    const RigidTransform truth = any_pose(9);
    const LandmarkPose pose = pose_from_landmarks(list, kViews, sightings(list, truth, 2, 1));
    EXPECT_LT(worst_mm(list, pose.world_from_ct, truth), 1);  // 1 px is 0.39 mm at the isocentre
    EXPECT_GT(pose.rms_px, 0.5);
    EXPECT_LT(pose.rms_px, 2);
    EXPECT_NEAR(pose.rms_mm / pose.rms_px, 200.0 / 512, 0.05);
    EXPECT_GT(pose.second_rms_px, 3 * pose.rms_px);
}

TEST(LandmarkPose, FewerThanFourOrCollinearOnesAreErrors) {
    const auto three = points(3, 1);
    EXPECT_THAT(error_of([&] { (void)pose_from_landmarks(three, kViews, sightings(three, any_pose(1), 2)); }),
                HasSubstr("at least 4"));
    std::vector<Eigen::Vector3d> line;
    for (int i = 0; i < 6; ++i) line.emplace_back(100 + 10 * i, -30 + 0.1 * (i % 2), 5 * i);
    EXPECT_THAT(error_of([&] { (void)pose_from_landmarks(line, kViews, sightings(line, any_pose(1), 2)); }),
                HasSubstr("on a line"));
    const std::vector<Eigen::Vector3d> same(5, Eigen::Vector3d(1, 2, 3));
    EXPECT_THAT(error_of([&] { (void)pose_from_landmarks(same, kViews, sightings(same, {}, 2)); }),
                HasSubstr("on a line"));
    EXPECT_THAT(error_of([&] { (void)pose_from_landmarks({}, kViews, {}); }), HasSubstr("= 0"));
}

TEST(LandmarkPose, PointsFarOutsideTheImageAreErrors) {
    const auto list = points(6, 1);
    auto seen = sightings(list, any_pose(1), 1);
    seen[3].pixel.x() = 5000;
    EXPECT_THAT(error_of([&] { (void)pose_from_landmarks(list, kViews, seen); }),
                testing::AllOf(HasSubstr("landmark 4"), HasSubstr("512 x 512")));
    seen[3].pixel.x() = NAN;
    EXPECT_THAT(error_of([&] { (void)pose_from_landmarks(list, kViews, seen); }), HasSubstr("landmark 4"));
}

}  // namespace
}  // namespace raylign::detail

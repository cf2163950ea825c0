#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/evaluation/dense_part.h"
#include "raylign/phantom.h"
#include "raylign/targets.h"

namespace raylign::detail {
namespace {

constexpr double kRounding_mm = 1e-11;  // of world coordinates near 1000 mm

std::vector<Eigen::Vector3d> some_targets(int count = 30) {
    Random random(4);
    std::vector<Eigen::Vector3d> targets;
    for (int i = 0; i < count; ++i) targets.push_back(random.uniform(0, 60) * random.direction());
    return targets;
}

RigidTransform some_pose() { return exp((Twist() << 0.4, -0.2, 0.7, 12, -30, 22).finished()); }

std::vector<ViewGeometry> biplane() {
    CArm c_arm{.sad_mm = 700,
               .sdd_mm = 1050,
               .primary_angle_deg = 0,
               .secondary_angle_deg = 0,
               .pixel_pitch_mm = {0.4, 0.5},
               .size_px = {512, 480},
               .principal_point_px = {}};
    ViewGeometry front = view_from_c_arm(c_arm);
    c_arm.primary_angle_deg = 90;
    return {front, view_from_c_arm(c_arm)};
}

TEST(TargetErrors, AreZeroForTheTruePose) {
    const TargetErrors errors = target_errors(some_pose(), some_pose(), some_targets(), biplane());
    EXPECT_EQ(errors.mtre_mm, 0);
    EXPECT_THAT(errors.mpd_mm, testing::ElementsAre(0, 0));
    EXPECT_THAT(errors.mrpd_mm, testing::ElementsAre(0, 0));
    EXPECT_EQ(errors.mean_mrpd_mm, 0);
}

TEST(TargetErrors, OfATranslationAreItsLengthForEveryTarget) {
    const RigidTransform found = RigidTransform::translate({1, -2, 2}) * some_pose();
    const TargetErrors errors = target_errors(found, some_pose(), some_targets(), biplane());
    for (const double tre_mm : errors.tre_mm) EXPECT_NEAR(tre_mm, 3, kRounding_mm);
    EXPECT_NEAR(errors.mtre_mm, 3, kRounding_mm);
    EXPECT_NEAR(mean_target_error_mm(found, some_pose(), some_targets()), 3, kRounding_mm);
}

TEST(TargetErrors, OfARotationAreItsChord) {
    const std::vector<Eigen::Vector3d> target = {{10, 0, 5}};  // 10 mm from the z axis
    const RigidTransform found = exp((Twist() << 0, 0, 0.3, 0, 0, 0).finished());
    EXPECT_NEAR(target_errors(found, {}, target, {}).mtre_mm, 20 * std::sin(0.15), kRounding_mm);
}

TEST(TargetErrors, OfADepthOffsetAreUnseenByItsView) {
    // The one target on the central axis moves along its own ray: TRE 7 mm, nothing on the detector.
    const std::vector<Eigen::Vector3d> isocentre = {{0, 0, 0}};
    const RigidTransform found = RigidTransform::translate({0, 7, 0});  // along the frontal view's axis
    const TargetErrors errors = target_errors(found, {}, isocentre, biplane());
    EXPECT_NEAR(errors.mtre_mm, 7, kRounding_mm);
    EXPECT_NEAR(errors.mrpd_mm[0], 0, kRounding_mm);
    EXPECT_NEAR(errors.mpd_mm[0], 0, kRounding_mm);
    EXPECT_NEAR(errors.mrpd_mm[1], 7 * 700 / std::hypot(700, 7), 1e-9);  // lever to the line from the lateral source
    EXPECT_NEAR(errors.mpd_mm[1], 7 * 1.5, 1e-9);                        // magnification sdd / sad
    EXPECT_NEAR(errors.mean_mrpd_mm, errors.mrpd_mm[1] / 2, kRounding_mm);
}

TEST(TargetErrors, ProjectionDistanceIsThePixelDistanceTimesThePitch) {
    const std::vector<ViewGeometry> views = biplane();
    const std::vector<Eigen::Vector3d> target = {{21, -13, 34}};
    const RigidTransform found = exp((Twist() << 0.05, 0.02, -0.04, 3, 2, -4).finished()) * some_pose();
    const TargetErrors errors = target_errors(found, some_pose(), target, views);
    for (std::size_t v = 0; v < 2; ++v) {
        const Eigen::Vector2d offset_px =
            project(views[v], found * target[0]) - project(views[v], some_pose() * target[0]);
        EXPECT_NEAR(errors.mpd_mm[v], offset_px.cwiseProduct(Eigen::Vector2d(0.4, 0.5)).norm(), 1e-9);
    }
}

TEST(TargetErrors, ProjectionDistanceIsNanWithoutSddOrBehindTheSource) {
    std::vector<ViewGeometry> views = biplane();
    views[0].camera.sdd_mm.reset();
    EXPECT_TRUE(std::isnan(target_errors({}, {}, some_targets(), views).mpd_mm[0]));
    EXPECT_FALSE(std::isnan(target_errors({}, {}, some_targets(), views).mpd_mm[1]));
    const RigidTransform behind = RigidTransform::translate({-800, 0, 0});  // past the lateral source, at x = -700
    EXPECT_TRUE(std::isnan(target_errors(behind, {}, some_targets(), views).mpd_mm[1]));
    EXPECT_TRUE(std::isnan(target_errors({}, {}, some_targets(), {}).mean_mrpd_mm));
}

TEST(TargetErrors, NeedTargets) {
    EXPECT_THROW((void)target_errors({}, {}, {}, {}), Error);
    EXPECT_THROW((void)mean_target_error_mm({}, {}, {}), Error);
    EXPECT_THROW((void)targets_centre_mm({}), Error);
    EXPECT_THROW((void)perturbed_start({}, {}, 1, 1), Error);
}

TEST(PerturbedStart, HasTheWantedError) {
    const auto targets = some_targets();
    for (const double mtre_mm : {1e-3, 0.5, 4.0, 25.0, 96.0, 500.0}) {  // 500: far beyond what rotations reach
        for (std::uint64_t seed = 0; seed < 50; ++seed) {
            const RigidTransform start = perturbed_start(some_pose(), targets, mtre_mm, seed);
            EXPECT_NEAR(mean_target_error_mm(start, some_pose(), targets), mtre_mm, 1e-9 * mtre_mm + kRounding_mm);
            const Eigen::Matrix3d product = start.rotation * start.rotation.transpose();
            EXPECT_LT((product - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-12);
        }
    }
}

TEST(PerturbedStart, WorksForOneTargetAndForCollinearOnes) {
    const std::vector<Eigen::Vector3d> one = {{5, 6, 7}}, line = {{0, 0, -30}, {0, 0, 0}, {0, 0, 30}};
    EXPECT_NEAR(mean_target_error_mm(perturbed_start({}, one, 8, 3), {}, one), 8, 1e-8);
    EXPECT_NEAR(mean_target_error_mm(perturbed_start({}, line, 8, 3), {}, line), 8, 1e-8);
}

TEST(PerturbedStart, ZeroErrorIsTheTruth) {
    EXPECT_EQ(to_matrix(perturbed_start(some_pose(), some_targets(), 0, 9)), to_matrix(some_pose()));
    EXPECT_THROW((void)perturbed_start({}, some_targets(), -1, 1), Error);
    EXPECT_THROW((void)perturbed_start({}, some_targets(), std::nan(""), 1), Error);
}

TEST(PerturbedStart, SharesVaryFromTranslationToRotation) {
    double least = 1e9, most = 0;
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
        const double angle = rotation_angle_rad(perturbed_start({}, some_targets(), 5, seed));
        least = std::min(least, angle);
        most = std::max(most, angle);
    }
    EXPECT_LT(least, 0.01);  // 5 mm at a lever of some 25 mm is 0.2 rad
    EXPECT_GT(most, 0.15);
    EXPECT_LT(most, 1.0);
}

TEST(PerturbedStart, MovesTheCentreOnlyByItsTranslation) {
    // About the targets' centre: a start that is nearly all rotation keeps the centre nearly in place, wherever world's
    // origin is.
    const auto targets = some_targets();
    const RigidTransform truth = RigidTransform::translate({0, 0, 5000}) * some_pose();
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
        const RigidTransform start = perturbed_start(truth, targets, 5, seed);
        const Eigen::Vector3d centre_ct = targets_centre_mm(targets);
        EXPECT_LT((start * centre_ct - truth * centre_ct).norm(), 1.0001 * 5);
    }
}

TEST(PerturbedStart, IsTheSameOnEveryMachine) {
    const Twist twist = log(perturbed_start({}, {{{10, 0, 0}, {0, 20, 0}, {0, 0, 30}}}, 10, 1));
    EXPECT_THAT(std::vector<double>(twist.data(), twist.data() + 6),
                testing::Pointwise(testing::DoubleNear(1e-9), {0.0979287548411, 0.361606548359, 0.205696182154,
                                                               2.81098188182, -0.303614075116, -6.22397172929}));
}

TEST(DefaultTargets, LieEvenlyInTheBoneOfTheSpine) {
    const Volume volume =
        voxelise(spine_phantom({200, 200, 200}), centred_grid({96, 96, 96}, {2.0833, 2.0833, 2.0833}), 2);
    const double threshold_per_mm = dense_threshold_per_mm(volume);
    EXPECT_GT(threshold_per_mm, 0.0205);  // above soft tissue with discs
    EXPECT_LT(threshold_per_mm, 0.0265);  // below cancellous bone
    for (const int count : {1, 10, 100, 400}) {
        const auto targets = default_targets_ct_mm(volume, count);
        EXPECT_GE(targets.size(), static_cast<std::size_t>(0.7 * count)) << count;
        EXPECT_LE(targets.size(), static_cast<std::size_t>(1.3 * count + 8)) << count;
        for (const Eigen::Vector3d& x_ct : targets) {
            const Eigen::Vector3d voxel = volume.grid.voxel_from_ct(x_ct);
            const Eigen::Vector3i at = voxel.array().round().matrix().cast<int>();
            EXPECT_LT((voxel - at.cast<double>()).norm(), 1e-9);  // a voxel's centre
            EXPECT_GT(volume(at.x(), at.y(), at.z()), threshold_per_mm);
        }
    }
}

TEST(DefaultTargets, FillAHomogeneousObjectOnALattice) {
    VoxelGrid grid = centred_grid({80, 40, 50}, {1, 2, 1.5});
    grid.direction = exp((Twist() << 0.3, 0.1, 0.2, 0, 0, 0).finished()).rotation;
    const Volume volume = voxelise({"box", {Box{{}, {20, 20, 20}, 0.01}}}, grid, 2);  // below bone: the percentile rule
    EXPECT_NEAR(dense_threshold_per_mm(volume), 0.005, 1e-5);
    const auto targets = default_targets_ct_mm(volume, 64);
    EXPECT_GE(targets.size(), 45U);
    EXPECT_LE(targets.size(), 90U);
    Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9), high = -low;
    for (const Eigen::Vector3d& x_ct : targets) {
        low = low.cwiseMin(x_ct);
        high = high.cwiseMax(x_ct);
    }
    EXPECT_LT(low.maxCoeff(), -10);  // reach towards all faces
    EXPECT_GT(high.minCoeff(), 10);
    EXPECT_LT(targets_centre_mm(targets).norm(), 5);
    EXPECT_EQ(default_targets_ct_mm(volume, 64), targets);
}

TEST(DefaultTargets, AFewOddVoxelsDecideNothing) {
    Volume volume{centred_grid({30, 30, 30}, {1, 1, 1}), std::vector<float>(27000, 0.01F)};
    for (int i = 0; i < 20; ++i) volume.attenuation_per_mm[i * 1000] = 5;  // metal: below a per mille
    EXPECT_NEAR(dense_threshold_per_mm(volume), 0.005, 0.001);
}

TEST(DefaultTargets, OfOneDenseVoxelAreThatVoxel) {
    Volume volume{centred_grid({30, 30, 30}, {1, 1, 1}), std::vector<float>(27000)};
    volume.attenuation_per_mm[volume.index(3, 4, 5)] = 1;
    const auto targets = default_targets_ct_mm(volume, 100);
    ASSERT_EQ(targets.size(), 1U);
    EXPECT_LT((targets[0] - volume.grid.ct_from_voxel({3, 4, 5})).norm(), 1e-12);
}

TEST(DefaultTargets, RefuseAnEmptyVolumeAndBadCounts) {
    Volume volume{centred_grid({3, 3, 3}, {1, 1, 1}), std::vector<float>(27)};
    EXPECT_THROW((void)default_targets_ct_mm(volume), Error);
    volume.attenuation_per_mm[5] = 1;
    EXPECT_THROW((void)default_targets_ct_mm(volume, 0), Error);
    EXPECT_THROW((void)default_targets_ct_mm(volume, 10001), Error);
}

}  // namespace
}  // namespace raylign::detail

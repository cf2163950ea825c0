#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/tracking/extrapolation.h"

namespace raylign::detail {
namespace {

const Eigen::Vector3d kCentre(12, -30, 7);

/// Turns about the moving centre and shifts it, both evenly.
RigidTransform steady(double time) {
    Twist turn = Twist::Zero();
    turn.head<3>() = time * Eigen::Vector3d(0.02, -0.05, 0.03);
    return RigidTransform::translate(time * Eigen::Vector3d(1.5, 2, -0.5)) * exp_about(turn, kCentre);
}

double apart(const RigidTransform& a, const RigidTransform& b) { return (to_matrix(a) - to_matrix(b)).norm(); }

std::vector<TimedPose> known(const std::vector<double>& times) {
    std::vector<TimedPose> poses;
    for (const double time : times) poses.push_back({time, steady(time)});
    return poses;
}

TEST(Extrapolation, AnEvenMotionGoesOn) {
    EXPECT_LT(apart(extrapolate(known({3, 4, 5}), 6, kCentre), steady(6)), 1e-12);
    EXPECT_LT(apart(extrapolate(known({1, 3, 5}), 6, kCentre), steady(6)), 1e-12) << "steps of two frames";
    EXPECT_LT(apart(extrapolate(known({3, 4, 5}), 7, kCentre), steady(7)), 1e-12) << "one frame was missing";
}

TEST(Extrapolation, OnePoseStaysAndTwoGoHalfAsFar) {
    EXPECT_LT(apart(extrapolate(known({5}), 6, kCentre), steady(5)), 1e-15);
    EXPECT_LT(apart(extrapolate(known({4, 5}), 6, kCentre), steady(5.5)), 1e-12);
}

TEST(Extrapolation, BeyondTwoFramesThePredictionIsHeld) {
    EXPECT_LT(apart(extrapolate(known({3, 4, 5}), 30, kCentre), steady(7)), 1e-12);
}

TEST(Extrapolation, FarApartPosesTellNoVelocity) {
    EXPECT_LT(apart(extrapolate(known({0, 1, 5}), 6, kCentre), steady(5)), 1e-15);
}

TEST(Extrapolation, ATurningObjectStaysInItsPlace) {
    std::vector<TimedPose> turning;
    for (int t = 0; t < 3; ++t) {
        Twist turn = Twist::Zero();
        turn[2] = 0.2 * t;
        turning.push_back({static_cast<double>(t), exp_about(turn, kCentre)});
    }
    EXPECT_LT((extrapolate(turning, 3, kCentre) * kCentre - kCentre).norm(), 1e-12);
}

TEST(Extrapolation, NothingToGoOnFromAndTimesBackwardsAreRefused) {
    EXPECT_THROW((void)extrapolate({}, 1, kCentre), Error);
    EXPECT_THROW((void)extrapolate(known({5, 4}), 6, kCentre), Error);
    EXPECT_THROW((void)extrapolate(known({4, 4}), 6, kCentre), Error);
}

}  // namespace
}  // namespace raylign::detail

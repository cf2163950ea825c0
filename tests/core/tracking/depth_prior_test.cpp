#include "core/tracking/depth_prior.h"

#include <gtest/gtest.h>

#include <cmath>

namespace raylign::detail {
namespace {

constexpr double kRadius_mm = 30;
const Eigen::Vector3d kCentre_ct_mm(4, -2, 7);

/// Depth along z: 2 mm unsure, and a turn about x that goes with it; the rest is sure to 0.1 mm and 0.001 rad.
RegistrationResult found() {
    RegistrationResult result;
    result.world_from_ct = exp((Twist() << 0.2, -0.1, 0.3, 10, 20, 900).finished());
    Confidence& confidence = result.confidence;
    confidence.is_estimated = true;
    confidence.covariance.diagonal() << 1e-4, 1e-6, 1e-6, 0.01, 0.01, 4;
    confidence.covariance(0, 5) = confidence.covariance(5, 0) = 0.01;
    return result;
}

Eigen::Vector3d centre_mm(const RegistrationResult& result) { return result.world_from_ct * kCentre_ct_mm; }

TEST(DepthPrior, AnEquallySurePriorTakesItHalfWay) {
    RegistrationResult result = found();
    const RegistrationResult before = result;
    ASSERT_TRUE(join_depth(result, {.ahead_mm = 3, .sigma_mm = 2}, kCentre_ct_mm, kRadius_mm));
    // A twist's shift turns with it: by half the product of 1.5 mm and 3 * 0.01 / 8 rad.
    EXPECT_LT((centre_mm(result) - centre_mm(before) - Eigen::Vector3d(0, 0, 1.5)).norm(), 0.51 * 1.5 * 0.00375);
    EXPECT_NEAR(result.confidence.in_depth_mm, std::sqrt(2.0), 1e-9);
    // The turn that goes with depth: 0.01 / (4 + 4) rad a mm; and it becomes surer.
    const Twist turn = log(result.world_from_ct * inverse(before.world_from_ct));
    EXPECT_NEAR(turn[0], 3 * 0.01 / 8, 1e-9);
    EXPECT_NEAR(result.confidence.covariance(0, 0), 1e-4 - 0.01 * 0.01 / 8, 1e-12);
    EXPECT_NEAR(result.confidence.covariance(3, 3), 0.01, 1e-12) << "the place in the plane has nothing to do with it";
}

TEST(DepthPrior, OfOneThatSaysNothingNothingComes) {
    RegistrationResult result = found();
    ASSERT_TRUE(join_depth(result, {.ahead_mm = 3, .sigma_mm = 1e6}, kCentre_ct_mm, kRadius_mm));
    EXPECT_LT((centre_mm(result) - centre_mm(found())).norm(), 1e-9);
    EXPECT_NEAR(result.confidence.in_depth_mm, 2, 1e-9);
}

TEST(DepthPrior, AContradictionIsLeftAlone) {
    RegistrationResult result = found();
    EXPECT_FALSE(join_depth(result, {.ahead_mm = 3.1 * std::sqrt(8.0), .sigma_mm = 2}, kCentre_ct_mm, kRadius_mm));
    EXPECT_EQ(centre_mm(result), centre_mm(found()));
    EXPECT_EQ(result.confidence.covariance, found().confidence.covariance);
}

TEST(DepthPrior, AnUnknownErrorIsLeftAlone) {
    RegistrationResult result = found();
    result.confidence.is_estimated = false;
    EXPECT_FALSE(join_depth(result, {.ahead_mm = 1, .sigma_mm = 2}, kCentre_ct_mm, kRadius_mm));
    EXPECT_EQ(centre_mm(result), centre_mm(found()));
}

}  // namespace
}  // namespace raylign::detail

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace raylign::detail {
namespace {

// Vigna's splitmix64.c, seed 1234567: the generator's published test vector.
TEST(Random, IsSplitMix64) {
    Random random(1234567);
    EXPECT_EQ(random.bits(), 6457827717110365317ULL);
    EXPECT_EQ(random.bits(), 3203168211198807973ULL);
    EXPECT_EQ(random.bits(), 9817491932198370423ULL);
    EXPECT_EQ(random.bits(), 4593380528125082431ULL);
    EXPECT_EQ(random.bits(), 16408922859458223821ULL);
}

// Means of 1e5 draws: the bounds are five standard errors.
TEST(Random, UniformHasItsMoments) {
    Random random(1);
    double sum = 0, squares = 0;
    for (int i = 0; i < 100000; ++i) {
        const double u = random.uniform();
        ASSERT_TRUE(u >= 0 && u < 1);
        sum += u - 0.5;
        squares += (u - 0.5) * (u - 0.5);
    }
    EXPECT_NEAR(sum / 1e5, 0, 5 * 0.2887 / 316);
    EXPECT_NEAR(squares / 1e5, 1.0 / 12, 5 * 0.0745 / 316);
}

TEST(Random, NormalHasItsMoments) {
    Random random(2);
    double sums[5] = {};
    for (int i = 0; i < 100000; ++i) {
        const double x = random.normal();
        for (int k = 1; k <= 4; ++k) sums[k] += std::pow(x, k) / 1e5;
    }
    EXPECT_NEAR(sums[1], 0, 5 * 1.0 / 316);
    EXPECT_NEAR(sums[2], 1, 5 * 1.414 / 316);
    EXPECT_NEAR(sums[3], 0, 5 * 3.873 / 316);  // sqrt(15)
    EXPECT_NEAR(sums[4], 3, 5 * 9.8 / 316);    // sqrt(96)
}

TEST(Random, DirectionIsAUnitVectorUniformOnTheSphere) {
    Random random(3);
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    for (int i = 0; i < 100000; ++i) {
        const Eigen::Vector3d d = random.direction();
        ASSERT_NEAR(d.norm(), 1, 1e-14);
        mean += d / 1e5;
        second += d * d.transpose() / 1e5;
    }
    EXPECT_LT(mean.cwiseAbs().maxCoeff(), 5 * 0.577 / 316);
    EXPECT_LT((second - Eigen::Matrix3d::Identity() / 3).cwiseAbs().maxCoeff(), 5 * 0.3 / 316);
}

}  // namespace
}  // namespace raylign::detail

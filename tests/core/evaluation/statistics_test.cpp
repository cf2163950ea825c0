#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/base/error.h"
#include "raylign/statistics.h"

namespace raylign::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Published: [Newcombe 1998], Statistics in Medicine 17, table I, method 3 (score, no continuity correction).
TEST(WilsonInterval, HasThePublishedValues) {
    struct Case {
        std::size_t successes, trials;
        double low, high;
    };
    for (const Case& c : {Case{81, 263, 0.2553, 0.3662}, Case{15, 148, 0.0624, 0.1605}, Case{0, 20, 0, 0.1611},
                          Case{1, 29, 0.0061, 0.1718}}) {
        const Proportion p = wilson_interval(c.successes, c.trials);
        EXPECT_NEAR(p.low, c.low, 5e-5) << c.successes << " of " << c.trials;
        EXPECT_NEAR(p.high, c.high, 5e-5) << c.successes << " of " << c.trials;
    }
}

TEST(WilsonInterval, SaysWhatAFullScoreProves) {
    EXPECT_NEAR(wilson_interval(20, 20).low, 0.8389, 5e-5);
    EXPECT_NEAR(wilson_interval(100, 100).low, 0.9630, 5e-5);
    EXPECT_NEAR(wilson_interval(400, 400).low, 0.9905, 5e-5);
    EXPECT_EQ(wilson_interval(20, 20).high, 1);
    EXPECT_EQ(wilson_interval(0, 20).low, 0);
}

TEST(WilsonInterval, IsSymmetricInSuccessAndFailureAndHoldsTheRate) {
    for (std::size_t s = 0; s <= 30; ++s) {
        const Proportion p = wilson_interval(s, 30), q = wilson_interval(30 - s, 30);
        EXPECT_NEAR(p.low, 1 - q.high, 1e-14);
        EXPECT_LE(p.low, p.rate);
        EXPECT_GE(p.high, p.rate);
    }
}

TEST(WilsonInterval, KnowsNothingWithoutTrials) {
    const Proportion p = wilson_interval(0, 0);
    EXPECT_EQ(p.low, 0);
    EXPECT_EQ(p.high, 1);
}

TEST(WilsonInterval, RefusesNonsense) {
    EXPECT_THROW((void)wilson_interval(3, 2), Error);
    EXPECT_THROW((void)wilson_interval(1, 2, 0), Error);
    EXPECT_THROW((void)wilson_interval(1, 2, NAN), Error);
}

TEST(Percentile, InterpolatesBetweenOrderStatistics) {
    const std::array values{15.0, 20.0, 35.0, 40.0, 50.0};  // numpy.percentile(..., 40) = 29
    EXPECT_DOUBLE_EQ(percentile(values, 0.4), 29);
    EXPECT_EQ(percentile(values, 0), 15);
    EXPECT_EQ(percentile(values, 0.5), 35);
    EXPECT_EQ(percentile(values, 1), 50);
}

TEST(Percentile, DoesNotMindTheOrderAndKeepsInfinity) {
    EXPECT_EQ(percentile(std::array{3.0, 1.0, 2.0}, 0.5), 2);
    EXPECT_EQ(percentile(std::array{kInfinity, 1.0, 2.0}, 0.5), 2);
    EXPECT_EQ(percentile(std::array{kInfinity, 1.0, 2.0}, 1), kInfinity);
}

TEST(Percentile, RefusesNanAndBadShares) {
    EXPECT_THROW((void)percentile(std::vector<double>{1.0, NAN}, 0.5), Error);
    EXPECT_THROW((void)percentile(std::array{1.0}, 1.5), Error);
    EXPECT_THROW((void)percentile(std::array{1.0}, NAN), Error);
    EXPECT_TRUE(std::isnan(percentile({}, 0.5)));
}

TEST(CaptureRange, EndsBeforeTheFirstIntervalBelowTheWantedShare) {
    EXPECT_EQ(
        capture_range_mm(std::vector<IntervalSuccess>{{0, 2, 10, 10}, {2, 4, 19, 20}, {4, 6, 9, 10}, {6, 8, 10, 10}}),
        4);
    EXPECT_EQ(capture_range_mm(std::vector<IntervalSuccess>{{0, 2, 9, 10}, {2, 4, 10, 10}}), 0);
    EXPECT_EQ(capture_range_mm(std::vector<IntervalSuccess>{{0, 2, 10, 10}, {2, 4, 0, 0}}), 2)
        << "nothing is known of it";
    EXPECT_EQ(capture_range_mm({}), 0);
}

}  // namespace
}  // namespace raylign::detail

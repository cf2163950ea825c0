#include "core/tracking/depth_gap.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/random.h"
#include "core/registration/scene/joint_update.h"

namespace raylign::detail {
namespace {

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;
const Pairs kOne{{0, 1}};
constexpr double kApart_mm = 12, kSpread_mm = 2;

/// Two objects that go through depth together, 12 mm apart, each seen with noise.
std::vector<DepthsOfFrame> noisy(int frames, std::uint64_t seed) {
    Random random(seed);
    std::vector<DepthsOfFrame> all;
    for (int t = 0; t < frames; ++t) {
        const double depth_mm = 900 + 5 * std::sin(0.2 * t);
        all.push_back({DepthSample{depth_mm + kSpread_mm * random.normal(), kSpread_mm},
                       DepthSample{depth_mm + kApart_mm + kSpread_mm * random.normal(), kSpread_mm}});
    }
    return all;
}

double rms_off(const std::vector<DepthsOfFrame>& frames, std::size_t object) {
    double squares = 0;
    for (std::size_t t = 0; t < frames.size(); ++t) {
        const double off = frames[t][object]->depth_mm - 900 - 5 * std::sin(0.2 * static_cast<double>(t)) -
                           kApart_mm * static_cast<double>(object);
        squares += off * off;
    }
    return std::sqrt(squares / static_cast<double>(frames.size()));
}

TEST(DepthGap, TwoThatStayApartTellEachOthersDepth) {
    const std::vector<DepthsOfFrame> seen = noisy(200, 3), held = hold_gaps(seen, kOne, 0.1);
    for (const std::size_t object : {0, 1}) {
        // Independent noise of two that share one depth: the mean of both, whose noise is 1 / sqrt(2).
        EXPECT_NEAR(rms_off(seen, object), kSpread_mm, 0.3);
        EXPECT_NEAR(rms_off(held, object), kSpread_mm / std::sqrt(2), 0.2);
    }
}

TEST(DepthGap, WhatIsToldIsNoSurerThanOneFramesDifference) {
    const double gap_mm = 0.5;
    const std::vector<DepthsOfFrame> held = hold_gaps(
        std::vector<DepthsOfFrame>(50, {DepthSample{900, kSpread_mm}, DepthSample{912, kSpread_mm}}), kOne, gap_mm);
    const double of_one = 2 * kSpread_mm * kSpread_mm * (1 - kCommonError);  // v
    const double used = gap_mm * gap_mm + (of_one + gap_mm * gap_mm) / 50, share = of_one / (of_one + used);
    // With half of each depth's gain: (1 - K H) S (1 - K H)^T + K R' K^T by hand.
    const double common = kSpread_mm * kSpread_mm * (1 + kCommonError) / 2;
    const double of_difference = (1 - share) * (1 - share) * of_one + share * share * (gap_mm * gap_mm + of_one);
    EXPECT_NEAR(held[7][0]->sigma_mm, std::sqrt(common + of_difference / 4), 1e-9);
    EXPECT_NEAR(held[7][1]->sigma_mm, held[7][0]->sigma_mm, 1e-9);
}

TEST(DepthGap, AWideGapSaysNothing) {
    const std::vector<DepthsOfFrame> seen = noisy(10, 7), held = hold_gaps(seen, kOne, 1000);
    for (std::size_t t = 0; t < seen.size(); ++t) EXPECT_NEAR(held[t][0]->depth_mm, seen[t][0]->depth_mm, 1e-3);
}

TEST(DepthGap, AFrameThatContradictsTheOthersStaysAndCountsForNothing) {
    std::vector<DepthsOfFrame> frames = noisy(50, 9);
    const std::vector<DepthsOfFrame> without = hold_gaps(frames, kOne, 1);
    frames.push_back({DepthSample{900, kSpread_mm}, DepthSample{990, kSpread_mm}});
    const std::vector<DepthsOfFrame> held = hold_gaps(frames, kOne, 1);
    EXPECT_EQ(held.back()[0]->depth_mm, 900);
    EXPECT_EQ(held.back()[1]->depth_mm, 990);
    EXPECT_NEAR(held[4][0]->depth_mm, without[4][0]->depth_mm, 0.05);
}

TEST(DepthGap, WithoutTheOtherOrOtherFramesNothingChanges) {
    std::vector<DepthsOfFrame> frames = noisy(5, 11);
    frames[2][1].reset();
    const std::vector<DepthsOfFrame> held = hold_gaps(frames, kOne, 1);
    EXPECT_EQ(held[2][0]->depth_mm, frames[2][0]->depth_mm);
    EXPECT_FALSE(held[2][1]);
    const std::vector<DepthsOfFrame> single(frames.begin(), frames.begin() + 1);
    EXPECT_EQ(hold_gaps(single, kOne, 1)[0][0]->depth_mm, single[0][0]->depth_mm);
}

TEST(DepthGap, SeveralPairsOfOneFrameCountTogether) {
    // The middle one is known badly, and lies 10 mm from one and 20 mm from the other; all frames say so.
    std::vector<DepthsOfFrame> frames(20, {DepthSample{900, 0.5}, DepthSample{910, 5}, DepthSample{930, 0.5}});
    frames[3][1]->depth_mm = 914;
    const std::vector<DepthsOfFrame> held = hold_gaps(frames, Pairs{{0, 1}, {1, 2}}, 0.2);
    EXPECT_NEAR(held[3][1]->depth_mm, 910, 0.4);
    EXPECT_NEAR(held[3][0]->depth_mm, 900, 0.4);
    EXPECT_NEAR(held[3][2]->depth_mm, 930, 0.4);
}

}  // namespace
}  // namespace raylign::detail

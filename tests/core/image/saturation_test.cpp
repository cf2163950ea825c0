#include "core/image/saturation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/random.h"

namespace raylign::detail {
namespace {

constexpr int kSize = 120;
constexpr double kCeiling = 1.3;

/// Soft tissue with a gradient, trabecular bone, and a disc of metal that lets nothing through.
Image knee(double metal_radius_px, double noise) {
    Image image(kSize, kSize);
    Random random(3);
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
            double value =
                0.3 + 0.2 * x / kSize + (x > 50 && x < 90 ? 0.3 + 0.05 * std::sin(1.3 * x) * std::sin(1.1 * y) : 0);
            if (std::hypot(x - 60, y - 60) < metal_radius_px) value = kCeiling;
            image(x, y) = static_cast<float>(value + noise * (random.uniform() - 0.5));
        }
    }
    return image;
}

TEST(FindSaturation, FindsTheFlatDenseDisc) {
    const auto found = find_saturation(knee(14, 0.02), {});
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->ceiling, kCeiling, 0.01);
    // The disc less the three pixels at its rim.
    EXPECT_NEAR(found->share, 3.14159 * 10.5 * 10.5 / (kSize * kSize), 0.006);
}

TEST(FindSaturation, BoneAloneIsNotFlat) { EXPECT_FALSE(find_saturation(knee(0, 0.02), {})); }

TEST(FindSaturation, WhatIsMaskedDoesNotCount) {
    Image weights(kSize, kSize, 1);
    for (int y = 40; y < 80; ++y) {
        for (int x = 40; x < 80; ++x) weights(x, y) = 0;
    }
    EXPECT_FALSE(find_saturation(knee(14, 0.02), weights));
}

TEST(FindSaturation, ACollimatorDoesNotCount) {
    Image image = knee(14, 0.02);
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < 30; ++x) image(x, y) = 5.5F;
    }
    const auto found = find_saturation(image, {});
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->ceiling, kCeiling, 0.01);
}

TEST(FindSaturation, MetalThatIsFlatToTheCountIsFoundBesideACollimator) {
    Image image = knee(14, 0);
    for (float& pixel : image.pixels) pixel = std::round(pixel * 100) / 100;
    for (const bool is_collimated : {false, true}) {
        for (int y = 0; is_collimated && y < kSize; ++y) {
            for (int x = 0; x < 30; ++x) image(x, y) = static_cast<float>(kCeiling);
        }
        const auto found = find_saturation(image, {});
        ASSERT_TRUE(found) << is_collimated;
        EXPECT_EQ(found->ceiling, static_cast<float>(kCeiling));
        EXPECT_GT(found->share, 0.02) << "the disc, and no crest of tissue";
    }
}

TEST(FindSaturation, AConstantOrEmptyImageHasNone) {
    EXPECT_FALSE(find_saturation(Image(kSize, kSize, 1.F), {}));
    EXPECT_FALSE(find_saturation(Image(kSize, kSize, 1.F), Image(kSize, kSize, 0.F)));
}

}  // namespace
}  // namespace raylign::detail

// What others show taken from an X-ray, at its own resolution and drawn coarser.

#include "core/registration/scene/remainder.h"

#include <gtest/gtest.h>

#include "core/image/pyramid.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

constexpr float kRounding = 2e-6F;  // of values up to 3 in floats

Image ramp(int width, int height, float scale) {
    Image image(width, height);
    for (int i = 0; i < width * height; ++i) image.pixels[i] = scale * static_cast<float>(i * 37 % 101) / 101;
    return image;
}

/// One view whose last row and column are odd.
std::vector<View> odd_view() {
    std::vector<View> views{test::biplane_views(32, 100).front()};
    views[0].geometry.camera.size_px = {31, 29};
    views[0].image = ramp(31, 29, 3);
    views[0].weights = ramp(31, 29, 1);
    return views;
}

TEST(Remainder, LeavesOutTheKeptOneAndWeighsTheOthersByTheGain) {
    const std::vector<View> views = odd_view();
    const Shown shown{{{ramp(31, 29, 1)}, {ramp(31, 29, 2)}}, {0.5}};
    const View left = remainder(views, shown, 0)[0], nothing_kept = remainder(views, shown, std::nullopt)[0];
    for (std::size_t i = 0; i < left.image.pixels.size(); ++i) {
        const float one = shown.drrs[0][0].pixels[i], other = shown.drrs[1][0].pixels[i];
        EXPECT_NEAR(left.image.pixels[i], views[0].image.pixels[i] - 0.5F * other, kRounding) << i;
        EXPECT_NEAR(nothing_kept.image.pixels[i], views[0].image.pixels[i] - 0.5F * (one + other), kRounding) << i;
    }
}

TEST(Remainder, OfCoarserDrrsIsWhatTheyLeaveOfTheHalvedView) {
    const std::vector<View> views = odd_view();
    for (const int halvings : {1, 2}) {
        const View coarse = halved(views[0], halvings);
        const Image drr = ramp(coarse.image.width, coarse.image.height, 2);
        const View left = halved(remainder(views, {{{drr}}, {0.5}, {halvings}}, std::nullopt)[0], halvings);
        for (std::size_t i = 0; i < drr.pixels.size(); ++i) {
            EXPECT_NEAR(left.image.pixels[i], coarse.image.pixels[i] - 0.5F * drr.pixels[i], kRounding) << i;
        }
    }
}

TEST(Remainder, OfNobodyElseIsTheView) {
    const std::vector<View> views = odd_view();
    const Shown shown{{{ramp(31, 29, 1)}}, {1}};
    EXPECT_EQ(remainder(views, shown, 0)[0].image.pixels, views[0].image.pixels);
}

}  // namespace
}  // namespace raylign::detail

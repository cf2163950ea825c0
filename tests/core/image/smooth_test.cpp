#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/image/smooth.h"

namespace raylign::detail {
namespace {

TEST(Smoothed, APointBecomesAGaussianOfThatSigma) {
    Image point(101, 81);
    point(50, 40) = 1;
    const Image s = smoothed(point, 6);
    double sum = 0, xx = 0, yy = 0;
    for (int y = 0; y < s.height; ++y) {
        for (int x = 0; x < s.width; ++x) {
            sum += s(x, y);
            xx += s(x, y) * (x - 50) * (x - 50);
            yy += s(x, y) * (y - 40) * (y - 40);
        }
    }
    EXPECT_NEAR(sum, 1, 1e-5);
    EXPECT_NEAR(std::sqrt(xx), 6, 0.55);  // r (r + 1) is 30 or 42: r = 6 gives 6.48, r = 5 gives 5.48
    EXPECT_NEAR(xx, yy, 1e-3);
    EXPECT_NEAR(s(50 + 8, 40) / s(50, 40), std::exp(-64 / (2 * xx)), 0.07);  // three boxes are a little flatter on top
}

TEST(Smoothed, KeepsAConstantUpToTheBorder) {
    for (const float v : smoothed(Image(17, 5, 3.5F), 40).pixels) EXPECT_FLOAT_EQ(v, 3.5F);
}

TEST(Smoothed, WorksOnOneRowAndRefusesBadSigmas) {
    EXPECT_EQ(smoothed(Image(9, 1, 1), 1).pixels.size(), 9u);
    EXPECT_THROW((void)smoothed(Image(9, 9), 0.5), Error);
    EXPECT_THROW((void)smoothed(Image(9, 9), std::nan("")), Error);
    EXPECT_THROW((void)smoothed(Image(9, 9), 1001), Error);
}

}  // namespace
}  // namespace raylign::detail

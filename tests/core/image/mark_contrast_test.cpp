#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/base/random.h"
#include "core/image/mark_contrast.h"

namespace raylign::detail {
namespace {

/// Bands of tissue with noise, a letter, a lead ball and pixels that are no image.
Image marked_image() {
    Image image(90, 70);
    Random random(7);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            image(x, y) = static_cast<float>(500 + 300 * std::sin(0.09 * x) + 20 * random.normal());
            if (x > 30 && x < 34 && y > 20 && y < 32) image(x, y) += 700;
            if (std::hypot(x - 60, y - 50) < 4) image(x, y) = 5;
            if (x < 3 || (x == 40 && y % 3 == 0)) image(x, y) = std::numeric_limits<float>::quiet_NaN();
        }
    }
    return image;
}

/// By its definition.
double contrast_at(const Image& image, double range, int window, int x, int y) {
    std::vector<float> around;
    for (int v = y - window; v <= y + window; v += window / 4) {
        for (int u = x - window; u <= x + window; u += window / 4) {
            if (u < 0 || v < 0 || u >= image.width || v >= image.height || !std::isfinite(image(u, v))) continue;
            around.push_back(image(u, v));
        }
    }
    std::ranges::sort(around);
    const double value = image(x, y), median = around[around.size() / 2], floor = 0.03 * range;
    return std::max(std::abs(value - median) / (0.25 * range),
                    std::abs(std::log((value + floor) / (median + floor))) / 0.9);
}

TEST(MarkContrast, IsWhatAMedianOfAllSamplesSaysWhereAMarkCouldBe) {
    const Image image = marked_image();
    constexpr double kRange = 1000;
    constexpr int kWindow = 8;
    const std::vector<double> contrast = mark_contrast(image, kRange, kWindow);
    int marks = 0, outlines = 0;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const double found = contrast[image.index(x, y)];
            if (!std::isfinite(image(x, y))) {
                ASSERT_EQ(found, 0);
                continue;
            }
            const double expected = contrast_at(image, kRange, kWindow, x, y);
            marks += expected > 1;
            outlines += expected > kOutlineContrast && expected <= 1;
            if (expected > kOutlineContrast) {
                ASSERT_DOUBLE_EQ(found, expected) << x << " " << y;
            } else {
                ASSERT_LE(found, kOutlineContrast) << x << " " << y;
            }
        }
    }
    EXPECT_GT(marks, 50);
    EXPECT_GT(outlines, 5);
}

}  // namespace
}  // namespace raylign::detail

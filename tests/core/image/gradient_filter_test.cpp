#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/image/gradient_filter.h"

namespace raylign::detail {
namespace {

const GradientFilter kFilters[] = {{3, 9}, {1, 3}, {0.5, 1}, {8, 20}};

TEST(GradientTaps, AreSymmetricAndAntisymmetricOfTheRightCount) {
    for (const GradientFilter& filter : kFilters) {
        const GradientTaps taps = gradient_taps(filter);
        const std::size_t count = 2 * filter.radius_px + 1;
        ASSERT_EQ(taps.smooth.size(), count);
        ASSERT_EQ(taps.derivative.size(), count);
        EXPECT_EQ(taps.radius_px, filter.radius_px);
        for (std::size_t i = 0; i < count; ++i) {
            EXPECT_EQ(taps.smooth[i], taps.smooth[count - 1 - i]);
            EXPECT_EQ(taps.derivative[i], -taps.derivative[count - 1 - i]);
        }
        EXPECT_EQ(taps.derivative[filter.radius_px], 0);
    }
}

TEST(GradientTaps, HaveUnitGains) {
    for (const GradientFilter& filter : kFilters) {
        const GradientTaps taps = gradient_taps(filter);
        double sum = 0, slope = 0;
        for (int k = -filter.radius_px; k <= filter.radius_px; ++k) {
            sum += taps.smooth[k + filter.radius_px];
            slope += k * taps.derivative[k + filter.radius_px];
        }
        EXPECT_NEAR(sum, 1, 1e-14);
        EXPECT_NEAR(slope, 1, 1e-14);
    }
}

TEST(GradientTaps, DefaultIsThePapers) {
    // [Ino06]: sigma 3, 19 taps, derivative proportional to k exp(-k^2 / 18).
    const GradientTaps taps = gradient_taps({});
    ASSERT_EQ(taps.derivative.size(), 19U);
    EXPECT_NEAR(taps.derivative[9 + 6] / taps.derivative[9 + 3], 2 * std::exp(-(36 - 9) / 18.0), 1e-14);
    EXPECT_NEAR(taps.smooth[9 + 3] / taps.smooth[9], std::exp(-0.5), 1e-14);
}

TEST(GradientTaps, RefuseBadWidths) {
    for (const GradientFilter& filter : {GradientFilter{0, 9}, {-1, 9}, {33, 9}, {std::nan(""), 9}, {3, 0}, {3, 65}}) {
        EXPECT_THROW((void)gradient_taps(filter), Error) << filter.sigma_px << " " << filter.radius_px;
    }
}

template <class Function>
Image image_of(int width, int height, const Function& f) {
    Image image(width, height);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) image(x, y) = static_cast<float>(f(x, y));
    }
    return image;
}

TEST(GradientImages, OfARampAreItsSlopesInside) {
    const Image ramp = image_of(50, 40, [](int x, int y) { return 0.5 * x - 0.25 * y + 3; });
    const auto [dx, dy] = gradient_images(ramp, gradient_taps({}));
    for (int y = 9; y < 31; ++y) {
        for (int x = 9; x < 41; ++x) {
            ASSERT_NEAR(dx(x, y), 0.5, 1e-6);  // float pixels near 28, and a float image between the passes
            ASSERT_NEAR(dy(x, y), -0.25, 1e-6);
        }
    }
}

TEST(GradientImages, OfAConstantAreZeroUpToTheBorder) {
    const auto [dx, dy] = gradient_images(Image(30, 25, 7.3F), gradient_taps({}));
    for (const float value : dx.pixels) ASSERT_EQ(value, 0);
    for (const float value : dy.pixels) ASSERT_EQ(value, 0);
}

TEST(GradientImages, AlongAnAxisOnWhichNothingChangesAreExactlyZero) {
    // Residues of 1e-17 that follow the image would correlate, and nobody would see that there is nothing to compare.
    const Image columns = image_of(40, 25, [](int x, int) { return std::sin(0.3 * x) + 0.1 * x; });
    const auto of_columns = gradient_images(columns, gradient_taps({}));
    for (const float value : of_columns[1].pixels) ASSERT_EQ(value, 0);
    const Image rows = image_of(40, 25, [](int, int y) { return std::sin(0.3 * y) + 0.1 * y; });
    const auto of_rows = gradient_images(rows, gradient_taps({}));
    for (const float value : of_rows[0].pixels) ASSERT_EQ(value, 0);
    const Image one_row = image_of(40, 1, [](int x, int) { return std::sin(0.3 * x); });
    const auto of_one_row = gradient_images(one_row, gradient_taps({}));
    for (const float value : of_one_row[1].pixels) ASSERT_EQ(value, 0);
}

TEST(GradientImages, OfAGaussianBlobAreTheAnalyticDerivative) {
    // G_s smoothed with G_f is G of variance s^2 + f^2; radius 5 sigma, so that cutting the taps does not show.
    constexpr double kBlob = 4, kFilter = 3, kX = 40.3, kY = 37.8, kVariance = kBlob * kBlob + kFilter * kFilter;
    const Image blob = image_of(80, 80, [](int x, int y) {
        return std::exp(-0.5 * ((x - kX) * (x - kX) + (y - kY) * (y - kY)) / (kBlob * kBlob));
    });
    const auto [dx, dy] = gradient_images(blob, gradient_taps({kFilter, 15}));
    for (int y = 20; y < 60; ++y) {
        for (int x = 20; x < 60; ++x) {
            const double g =
                kBlob * kBlob / kVariance * std::exp(-0.5 * ((x - kX) * (x - kX) + (y - kY) * (y - kY)) / kVariance);
            // Taps sampled at whole pixels stand for the integral to exp(-2 (pi sigma)^2) < 1e-70; cut at 5 sigma 1e-5
            // of g / sigma.
            ASSERT_NEAR(dx(x, y), -(x - kX) / kVariance * g, 3e-6) << x << " " << y;
            ASSERT_NEAR(dy(x, y), -(y - kY) / kVariance * g, 3e-6) << x << " " << y;
        }
    }
}

TEST(GradientImages, TransposedImageGivesTransposedGradients) {
    Random random(41);
    const Image image = image_of(23, 17, [&](int, int) { return random.uniform(); });
    const Image transposed = image_of(17, 23, [&](int x, int y) { return image(y, x); });
    const auto a = gradient_images(image, gradient_taps({1, 3})),
               b = gradient_images(transposed, gradient_taps({1, 3}));
    for (int y = 0; y < 17; ++y) {
        for (int x = 0; x < 23; ++x) {
            ASSERT_NEAR(a[0](x, y), b[1](y, x), 1e-7);
            ASSERT_NEAR(a[1](x, y), b[0](y, x), 1e-7);
        }
    }
}

TEST(GradientImages, AreThePlainSumsOfTapsAtAnyWidth) {
    Random random(42);
    const GradientTaps taps = gradient_taps({1.5, 4});
    for (const int width : {1, 3, 31, 32, 33, 67}) {
        const Image image = image_of(width, 9, [&](int, int) { return random.uniform(); });
        const auto gradients = gradient_images(image, taps);
        for (int y = 0; y < 9; ++y) {
            for (int x = 0; x < width; ++x) {
                double along_x = 0, along_y = 0;
                for (int j = -4; j <= 4; ++j) {
                    for (int i = -4; i <= 4; ++i) {
                        const double pixel = image(std::clamp(x + i, 0, width - 1), std::clamp(y + j, 0, 8));
                        along_x += taps.derivative[i + 4] * taps.smooth[j + 4] * pixel;
                        along_y += taps.smooth[i + 4] * taps.derivative[j + 4] * pixel;
                    }
                }
                ASSERT_NEAR(gradients[0](x, y), along_x, 1e-7) << x << " " << y << " of " << width;  // of floats
                ASSERT_NEAR(gradients[1](x, y), along_y, 1e-7) << x << " " << y << " of " << width;
            }
        }
    }
}

TEST(GradientImages, WorkOnImagesSmallerThanTheFilter) {
    const auto [dx, dy] = gradient_images(image_of(2, 1, [](int x, int) { return x; }), gradient_taps({}));
    EXPECT_GT(dx(0, 0), 0);
    EXPECT_NEAR(dy(0, 0), 0, 1e-7);
}

TEST(ErodeWeights, ClearsTheFiltersSquareAroundAMaskedPixel) {
    Image weights(20, 15, 0.5F);
    weights(8, 2) = 0;
    const Image eroded = erode_weights(weights, 3);
    for (int y = 0; y < 15; ++y) {
        for (int x = 0; x < 20; ++x) {
            const bool near = std::abs(x - 8) <= 3 && std::abs(y - 2) <= 3;
            ASSERT_EQ(eroded(x, y), near ? 0.F : 0.5F) << x << " " << y;
        }
    }
}

TEST(ErodeWeights, KeepsTheBorderAndEmptyStaysEmpty) {
    EXPECT_EQ(erode_weights(Image(6, 5, 1), 9).pixels, Image(6, 5, 1).pixels);
    EXPECT_TRUE(erode_weights({}, 9).empty());
}

}  // namespace
}  // namespace raylign::detail

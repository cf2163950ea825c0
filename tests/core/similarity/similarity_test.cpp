#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/similarity/similarity.h"
#include "tests/support/errors.h"

namespace raylign::detail {
namespace {

Image random_image(int width, int height, std::uint64_t seed) {
    Image image(width, height);
    Random random(seed);
    for (float& pixel : image.pixels) pixel = static_cast<float>(random.uniform(1, 2));
    return image;
}

Image affine(const Image& image, double gain, double offset) {
    Image out = image;
    for (float& pixel : out.pixels) pixel = static_cast<float>(gain * pixel + offset);
    return out;
}

View view_of(Image image) {
    View view;
    view.name = "AP";
    view.geometry.camera = camera_from_pitch({image.width, image.height}, 1000, {1, 1}, {0, 0});
    view.image = std::move(image);
    return view;
}

double ncc(const Image& a, const Image& b) {
    return normalized_cross_correlation(moment_sums(a, b, Image(a.width, a.height, 1)));
}

constexpr double kRounding = 1e-12;  // double sums of 400 pixels near 1.5, variance 1/12
constexpr double kFloat = 1e-6;      // after gain and offset, pixels are rounded to float again

TEST(Ncc, OfAnImageWithItselfIsOne) {
    const Image a = random_image(20, 20, 1);
    EXPECT_NEAR(ncc(a, a), 1, kRounding);
}

TEST(Ncc, IgnoresGainAndOffset) {
    const Image a = random_image(20, 20, 1), b = random_image(20, 20, 2);
    EXPECT_NEAR(ncc(a, affine(a, 2.5, -7)), 1, kFloat);
    EXPECT_NEAR(ncc(a, affine(b, 0.3, 11)), ncc(a, b), kFloat);
    EXPECT_NEAR(ncc(affine(a, 4, 1), b), ncc(a, b), kFloat);
}

TEST(Ncc, OfTheInvertedImageIsMinusOne) {
    const Image a = random_image(20, 20, 1);
    EXPECT_NEAR(ncc(a, affine(a, -1, 5)), -1, kFloat);
}

TEST(Ncc, EqualsTheTwoPassFormulaWithWeights) {
    const Image a = random_image(30, 20, 1), b = random_image(30, 20, 2);
    Image w = random_image(30, 20, 3);
    for (std::size_t i = 0; i < w.pixels.size(); i += 3) w.pixels[i] = 0;
    double sum_w = 0, mean_a = 0, mean_b = 0, aa = 0, bb = 0, ab = 0;
    for (std::size_t i = 0; i < w.pixels.size(); ++i) sum_w += w.pixels[i];
    for (std::size_t i = 0; i < w.pixels.size(); ++i) {
        mean_a += w.pixels[i] / sum_w * a.pixels[i];
        mean_b += w.pixels[i] / sum_w * b.pixels[i];
    }
    for (std::size_t i = 0; i < w.pixels.size(); ++i) {
        const double da = a.pixels[i] - mean_a, db = b.pixels[i] - mean_b;
        aa += w.pixels[i] * da * da;
        bb += w.pixels[i] * db * db;
        ab += w.pixels[i] * da * db;
    }
    EXPECT_NEAR(normalized_cross_correlation(moment_sums(a, b, w)), ab / std::sqrt(aa * bb), kRounding);
}

TEST(Ncc, OfAConstantMovingImageIsZero) {
    for (const float constant : {0.F, 0.1F, 7.3F, 1e6F, -1e-6F}) {
        EXPECT_EQ(ncc(random_image(200, 200, 1), Image(200, 200, constant)), 0) << constant;
    }
}

TEST(Ncc, OfNanIsNan) {
    Image b = random_image(20, 20, 2);
    b(3, 3) = std::numeric_limits<float>::quiet_NaN();
    EXPECT_TRUE(std::isnan(ncc(random_image(20, 20, 1), b)));
}

TEST(MomentSums, SkipMaskedPixelsEvenIfNan) {
    Image a(3, 1, 2), b(3, 1, 5), w(3, 1, 0.5);
    a(1, 0) = std::numeric_limits<float>::quiet_NaN();
    w(1, 0) = 0;
    const MomentSums s = moment_sums(a, b, w);
    EXPECT_EQ(s.weight, 1);
    EXPECT_EQ(s.fixed, 2);
    EXPECT_EQ(s.fixed_fixed, 4);
    EXPECT_EQ(s.moving, 5);
    EXPECT_EQ(s.moving_moving, 25);
    EXPECT_EQ(s.fixed_moving, 10);
}

TEST(MomentSums, OfPartsAddUp) {
    const Image a = random_image(20, 20, 1), b = random_image(20, 20, 2);
    Image left(20, 20), right(20, 20);
    for (int y = 0; y < 20; ++y) {
        for (int x = 0; x < 20; ++x) (x < 7 ? left : right)(x, y) = 1;
    }
    MomentSums sum = moment_sums(a, b, left);
    sum += moment_sums(a, b, right);
    const MomentSums whole = moment_sums(a, b, Image(20, 20, 1));
    EXPECT_NEAR(sum.weight, whole.weight, 1e-9);
    EXPECT_NEAR(sum.fixed, whole.fixed, 1e-9);
    EXPECT_NEAR(sum.fixed_fixed, whole.fixed_fixed, 1e-9);
    EXPECT_NEAR(sum.moving, whole.moving, 1e-9);
    EXPECT_NEAR(sum.moving_moving, whole.moving_moving, 1e-9);
    EXPECT_NEAR(sum.fixed_moving, whole.fixed_moving, 1e-9);
}

TEST(ViewCost, IsZeroForEqualTwoForInvertedOneForConstant) {
    for (const Metric metric : {Metric::gc, Metric::ncc}) {
        const Similarity similarity{metric, {1, 3}};
        const Image image = random_image(40, 30, 1);
        const FixedChannels fixed = make_fixed_channels(view_of(image), similarity);
        const auto cost = [&](const Image& drr) {
            const auto moving = moving_channels(drr, similarity);
            std::vector<MomentSums> sums;
            for (std::size_t c = 0; c < moving.size(); ++c) {
                sums.push_back(moment_sums(fixed.channels[c], moving[c], fixed.weights));
            }
            EXPECT_EQ(sums.size(), static_cast<std::size_t>(channel_count(metric)));
            return view_cost(sums);
        };
        EXPECT_NEAR(cost(image), 0, kRounding);
        EXPECT_NEAR(cost(affine(image, -2, 9)), 2, kFloat);
        EXPECT_NEAR(cost(Image(40, 30, 3.3F)), 1, kRounding) << metric_name(metric);
    }
}

void expect_refused(const View& view, const std::vector<std::string>& reasons, Metric metric = Metric::gc) {
    const std::string message = test::error_of([&] { (void)make_fixed_channels(view, {metric, {1, 3}}); });
    for (const std::string& reason : reasons) EXPECT_THAT(message, testing::HasSubstr(reason));
    EXPECT_THAT(message, testing::HasSubstr("AP"));
}

TEST(FixedChannels, RefuseAConstantImage) {
    for (const float constant : {0.F, 0.1F, 7.3F, 1234.567F}) {
        for (const Metric metric : {Metric::gc, Metric::ncc}) {
            expect_refused(view_of(Image(40, 30, constant)), {"constant"}, metric);
            expect_refused(view_of(Image(512, 512, constant)), {"constant"}, metric);
        }
    }
}

TEST(FixedChannels, RefuseNanNamingThePixel) {
    Image image = random_image(40, 30, 1);
    image(12, 7) = std::numeric_limits<float>::quiet_NaN();
    expect_refused(view_of(image), {"pixel (12, 7)", "nan"});
}

TEST(FixedChannels, TakeAMaskedNan) {
    View view = view_of(random_image(40, 30, 1));
    view.image(12, 7) = std::numeric_limits<float>::quiet_NaN();
    view.weights = Image(40, 30, 1);
    view.weights(12, 7) = 0;
    const FixedChannels fixed = make_fixed_channels(view, {Metric::gc, {1, 3}});
    for (const Image& channel : fixed.channels) {
        for (const float pixel : channel.pixels) ASSERT_TRUE(std::isfinite(pixel));
    }
    EXPECT_EQ(fixed.weights(9, 4), 0);  // within the filter's support of the masked one
    EXPECT_EQ(fixed.weights(8, 4), 1);
}

TEST(FixedChannels, RefuseAMaskThatLeavesTooLittle) {
    View view = view_of(random_image(40, 30, 1));
    view.weights = Image(40, 30);
    for (int i = 0; i < kMinPixels - 1; ++i) view.weights(i, 5) = 1;
    expect_refused(view, {"31", "32"}, Metric::ncc);
    view.weights(35, 5) = 1;
    EXPECT_NO_THROW((void)make_fixed_channels(view, {Metric::ncc, {}}));
    expect_refused(view, {"usable pixels = 0"}, Metric::gc);  // all eroded
}

TEST(FixedChannels, RefuseSizesThatDifferNamingBoth) {
    View view = view_of(random_image(40, 30, 1));
    view.geometry.camera.size_px = {41, 30};
    expect_refused(view, {"40 x 30", "41 x 30"});
    view = view_of(random_image(40, 30, 1));
    view.weights = Image(40, 29, 1);
    expect_refused(view, {"40 x 29", "40 x 30"});
    view.image = {};
    expect_refused(view, {"no image"});
}

TEST(FixedChannels, RefuseWeightsThatAreNegativeOrNotFinite) {
    for (const float weight : {-1.F, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        View view = view_of(random_image(40, 30, 1));
        view.weights = Image(40, 30, 1);
        view.weights(5, 6) = weight;
        expect_refused(view, {"weight of pixel (5, 6)"});
    }
}

TEST(Metric, NamesRoundTripAndOthersAreRefused) {
    for (const Metric metric : {Metric::gc, Metric::ncc}) EXPECT_EQ(metric_from_name(metric_name(metric)), metric);
    EXPECT_THROW((void)metric_from_name("NCC"), Error);
}

}  // namespace
}  // namespace raylign::detail

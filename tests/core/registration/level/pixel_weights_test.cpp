#include <gtest/gtest.h>

#include <algorithm>

#include "core/base/error.h"
#include "core/image/smooth.h"
#include "core/registration/level/pixel_weights.h"
#include "core/similarity/robust_weights.h"
#include "raylign/backends.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

constexpr int kSide = 40;

/// A spine that does not fill its images, with noise; `masked` hides a corner of the second view.
struct WeightsCase {
    explicit WeightsCase(bool masked = false) {
        if (masked) {
            views[1].weights = Image(kSide, kSide, 1);
            for (int y = 0; y < 22; ++y) {
                for (int x = 0; x < 25; ++x) views[1].weights(x, y) = 0;
            }
        }
        session = make_session();
    }
    [[nodiscard]] std::unique_ptr<Session> make_session() const {
        return backend->prepare({volume, views, {}, {Metric::gc, {1, 2}}});
    }
    Volume volume = test::spine_volume(24);
    RigidTransform truth = test::oblique_pose();
    std::vector<View> views =
        test::with_exact_images(test::biplane_views(kSide, 320), spine_phantom({160, 160, 160}), truth, 5000);
    std::unique_ptr<Backend> backend = create_backend("cpu").backend;
    std::unique_ptr<Session> session;
};

std::vector<Image> even_weights(float value) { return std::vector<Image>(2, Image(kSide, kSide, value)); }

TEST(Neighbourhood, WithoutAMarginIsWhereTheDrrIs) {
    const WeightsCase c;
    const std::vector<Image> domain = neighbourhood(*c.session, c.truth, 0);
    ASSERT_EQ(domain.size(), 2u);
    for (std::size_t v = 0; v < 2; ++v) {
        const Image drr = c.session->render(c.truth, v);
        for (std::size_t i = 0; i < drr.pixels.size(); ++i) {
            ASSERT_EQ(domain[v].pixels[i], drr.pixels[i] > 0 ? 1 : 0) << v << " " << i;
        }
        EXPECT_EQ(*std::ranges::min_element(domain[v].pixels), 0) << "the object does not fill the image";
    }
}

TEST(Neighbourhood, ReachesASquaresHalfSideBeyondTheDrr) {
    const WeightsCase c;
    for (const int margin : {1, 3}) {
        const std::vector<Image> domain = neighbourhood(*c.session, c.truth, margin);
        for (std::size_t v = 0; v < 2; ++v) {
            const Image drr = c.session->render(c.truth, v);
            for (int y = 0; y < kSide; ++y) {
                for (int x = 0; x < kSide; ++x) {
                    bool is_near = false;
                    for (int b = std::max(0, y - margin); b <= std::min(kSide - 1, y + margin); ++b) {
                        for (int a = std::max(0, x - margin); a <= std::min(kSide - 1, x + margin); ++a) {
                            is_near |= drr(a, b) > 0;
                        }
                    }
                    ASSERT_EQ(domain[v](x, y), is_near ? 1 : 0) << v << ": " << x << " " << y << ", " << margin;
                }
            }
        }
    }
}

TEST(LocalNormalisation, IsTheMeanEnergyOverTheLocalOne) {
    const WeightsCase c(true);
    const std::vector<Image> found = local_normalisation(*c.session, 2.5);
    for (std::size_t v = 0; v < 2; ++v) {
        const FixedChannels& fixed = c.session->fixed_channels(v);
        Image energy(kSide, kSide);
        double sum = 0;
        int count = 0;
        for (std::size_t i = 0; i < energy.pixels.size(); ++i) {
            if (fixed.weights.pixels[i] == 0) continue;
            const double dx = fixed.channels[0].pixels[i], dy = fixed.channels[1].pixels[i];
            energy.pixels[i] = static_cast<float>(dx * dx + dy * dy);
            sum += dx * dx + dy * dy;
            ++count;
        }
        const double mean = sum / count;
        const Image local = smoothed(energy, 2.5);
        for (std::size_t i = 0; i < energy.pixels.size(); ++i) {
            const double expected = mean / (local.pixels[i] + mean / 20);
            ASSERT_NEAR(found[v].pixels[i], expected, 1e-5 * expected) << v << " " << i;
        }
    }
}

TEST(LocalNormalisation, DoesNotDependOnTheContrast) {
    WeightsCase c;
    const std::vector<Image> before = local_normalisation(*c.session, 3);
    for (View& view : c.views) {
        for (float& pixel : view.image.pixels) pixel *= 8;  // exact in floats
    }
    const std::vector<Image> after = local_normalisation(*c.make_session(), 3);
    for (std::size_t v = 0; v < 2; ++v) EXPECT_EQ(after[v].pixels, before[v].pixels);
}

TEST(LocalNormalisation, WidthsOutOfTheFiltersRangeAreItsEnds) {
    const WeightsCase c;
    EXPECT_EQ(local_normalisation(*c.session, 0.1)[0].pixels, local_normalisation(*c.session, 1)[0].pixels);
}

TEST(LeavesEnough, AsksForTheFewestPixelsInEveryView) {
    const WeightsCase c;
    const auto first = [](int count) {
        Image weights(kSide, kSide, 0);
        std::fill_n(weights.pixels.begin() + 10 * kSide, count, 0.1F);
        return weights;
    };
    const Image all(kSide, kSide, 1);
    EXPECT_TRUE(leaves_enough(*c.session, {first(kMinPixels), all}));
    EXPECT_FALSE(leaves_enough(*c.session, {first(kMinPixels - 1), all}));
    EXPECT_FALSE(leaves_enough(*c.session, {all, first(kMinPixels - 1)}));
}

TEST(LeavesEnough, MaskedPixelsDoNotCount) {
    const WeightsCase c(true);
    std::vector<Image> weights = even_weights(1);
    EXPECT_TRUE(leaves_enough(*c.session, weights));
    for (int y = 22; y < kSide; ++y) std::fill_n(&weights[1](0, y), kSide, 0.F);
    for (int y = 0; y < 22; ++y) std::fill_n(&weights[1](27, y), kSide - 27, 0.F);
    EXPECT_FALSE(leaves_enough(*c.session, weights)) << "all that is left is masked, or within the filter's reach";
}

TEST(LeavesEnough, AgreesWithWhatSetWeightsRefuses) {
    const WeightsCase c;
    std::vector<Image> weights = even_weights(0);
    std::fill_n(weights[0].pixels.begin(), kMinPixels, 1.F);
    std::fill_n(weights[1].pixels.begin(), kMinPixels, 1.F);
    EXPECT_NO_THROW(c.session->set_weights(weights));
    weights[1].pixels[3] = 0;
    EXPECT_THROW(c.session->set_weights(weights), Error);
}

TEST(Multiply, IsPixelByPixel) {
    std::vector<Image> a = even_weights(2);
    std::vector<Image> b = even_weights(3);
    b[1](5, 7) = 0.25F;
    multiply(a, b);
    EXPECT_EQ(a[0].pixels, Image(kSide, kSide, 6).pixels);
    EXPECT_EQ(a[1](5, 7), 0.5F);
    EXPECT_EQ(a[1](7, 5), 6);
}

TEST(Multiply, RefusesSizesThatDisagree) {
    std::vector<Image> a = even_weights(1);
    EXPECT_THROW(multiply(a, {Image(kSide, kSide, 1)}), Error);
    EXPECT_THROW(multiply(a, {Image(kSide, kSide, 1), Image(kSide, kSide + 1, 1)}), Error);
}

TEST(PixelWeights, AreTheBaseOnceMade) {
    const WeightsCase c;
    const std::vector<Image> base = even_weights(0.75F);
    const PixelWeights weights(*c.session, base);
    EXPECT_EQ(c.session->fixed_channels(1).weights.pixels, base[1].pixels);
}

TEST(PixelWeights, AreTheBaseTimesTheRobustOnes) {
    const WeightsCase c(true);
    std::vector<Image> base = even_weights(1);
    for (Image& image : base) {
        for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(i % 5);
    }
    PixelWeights weights(*c.session, base);
    weights.reweight(c.truth);
    const auto other = c.make_session();
    other->set_weights(base);
    for (std::size_t v = 0; v < 2; ++v) {
        const FixedChannels& fixed = other->fixed_channels(v);
        const Image robust = robust_weights(fixed, other->moving_channels(c.truth, v));
        const std::vector<float>& found = c.session->fixed_channels(v).weights.pixels;
        for (std::size_t i = 0; i < found.size(); ++i) {
            ASSERT_EQ(found[i], robust.pixels[i] * fixed.weights.pixels[i]) << v << " " << i;
        }
    }
}

TEST(PixelWeights, AreRenewedNotHeapedUp) {
    const WeightsCase c;
    PixelWeights weights(*c.session, even_weights(0.5F));
    weights.reweight(c.truth);
    const std::vector<float> once = c.session->fixed_channels(0).weights.pixels;
    weights.reweight(RigidTransform::translate({9, 0, 4}) * c.truth);
    EXPECT_NE(c.session->fixed_channels(0).weights.pixels, once);
    weights.reweight(c.truth);
    EXPECT_EQ(c.session->fixed_channels(0).weights.pixels, once);
}

TEST(PixelWeights, MaskedPixelsStayOut) {
    const WeightsCase c(true);
    PixelWeights weights(*c.session, even_weights(1));
    weights.reweight(c.truth);
    const Image& found = c.session->fixed_channels(1).weights;
    for (int y = 0; y < 22; ++y) {
        for (int x = 0; x < 25; ++x) ASSERT_EQ(found(x, y), 0) << x << " " << y;
    }
    EXPECT_GT(*std::ranges::max_element(found.pixels), 0);
}

}  // namespace
}  // namespace raylign::detail

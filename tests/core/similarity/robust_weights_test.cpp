#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/similarity/robust_weights.h"

namespace raylign::detail {
namespace {

constexpr int kSide = 40;

/// Two channels of smooth waves: the fixed ones are `gain` times the moving ones plus unit noise.
struct Pair {
    explicit Pair(float gain = 3) {
        Random random(1);
        fixed.weights = Image(kSide, kSide, 1);
        for (int c = 0; c < 2; ++c) {
            moving.emplace_back(kSide, kSide);
            fixed.channels.emplace_back(kSide, kSide);
            for (int i = 0; i < kSide * kSide; ++i) {
                const float wave = std::sin(0.3F * (i % kSide) + c) * std::cos(0.2F * (i / kSide));
                moving[c].pixels[i] = wave;
                fixed.channels[c].pixels[i] = gain * 10 * wave + static_cast<float>(random.normal());
            }
        }
    }
    FixedChannels fixed;
    std::vector<Image> moving;
};

double mean_weight(const Image& weights) {
    double sum = 0;
    for (const float w : weights.pixels) sum += w;
    return sum / static_cast<double>(weights.pixels.size());
}

TEST(RobustWeights, TakeAForeignEdgeOutAndKeepTheRest) {
    Pair p;
    for (int y = 0; y < kSide; ++y) p.fixed.channels[0](20, y) += 100;  // a rod: 100 sigma
    const Image w = robust_weights(p.fixed, p.moving);
    for (int y = 0; y < kSide; ++y) EXPECT_LT(w(20, y), 1e-3);
    // Unit normal noise in two channels: r^2 / s^2 is exponential with mean 2; E (1 + r^2 / 6.25 s^2)^-2 = 0.638.
    double rest = 0;
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) rest += x == 20 ? 0 : w(x, y) / (kSide * (kSide - 1.0));
    }
    EXPECT_NEAR(rest, 0.638, 0.04);
}

TEST(RobustWeights, DoNotDependOnTheGainOfTheImages) {
    Pair p, q;
    for (Image& image : q.moving) {
        for (float& pixel : image.pixels) pixel = 0.125F * pixel + 7;
    }
    const Image a = robust_weights(p.fixed, p.moving), b = robust_weights(q.fixed, q.moving);
    for (std::size_t i = 0; i < a.pixels.size(); ++i) EXPECT_NEAR(a.pixels[i], b.pixels[i], 1e-4);
}

TEST(RobustWeights, WithoutAPoseWeighStrongGradientsDown) {
    Pair p(0);  // noise only
    p.fixed.channels[1](5, 5) = 50;
    const Image w = robust_weights(p.fixed, {});
    EXPECT_LT(w(5, 5), 0.01);
    EXPECT_GT(mean_weight(w), 0.5);
}

TEST(RobustWeights, AnInvertedDrrExplainsNothing) {
    Pair p;
    Pair inverted;
    for (Image& image : inverted.moving) {
        for (float& pixel : image.pixels) pixel = -pixel;
    }
    const Image none = robust_weights(p.fixed, {}), w = robust_weights(inverted.fixed, inverted.moving);
    EXPECT_EQ(w.pixels, none.pixels);
}

TEST(RobustWeights, MaskedPixelsStayOutAndDecideNothing) {
    Pair p;
    const Image before = robust_weights(p.fixed, p.moving);
    Pair masked;
    for (int y = 0; y < kSide; ++y) {
        masked.fixed.weights(0, y) = 0;
        masked.fixed.channels[0](0, y) = 1e6F;
    }
    const Image w = robust_weights(masked.fixed, masked.moving);
    EXPECT_EQ(w(0, 3), 0);
    EXPECT_NEAR(w(9, 9), before(9, 9), 0.05);
}

TEST(RobustWeights, WithoutResidualAllPixelsCount) {
    Pair p;
    for (int c = 0; c < 2; ++c) p.fixed.channels[c] = p.moving[c];
    for (const float w : robust_weights(p.fixed, p.moving).pixels) EXPECT_GT(w, 0.1);
    FixedChannels flat{{Image(8, 8, 2)}, Image(8, 8, 1)};
    for (const float w : robust_weights(flat, {}).pixels) EXPECT_EQ(w, 1);
}

TEST(RobustWeights, RefusesWhatDoesNotFit) {
    Pair p;
    std::vector<Image> one{p.moving[0]}, small{Image(3, 3), Image(3, 3)};
    EXPECT_THROW((void)robust_weights(p.fixed, one), Error);
    EXPECT_THROW((void)robust_weights(p.fixed, small), Error);
    p.fixed.weights = Image(kSide, kSide, 0);
    EXPECT_THROW((void)robust_weights(p.fixed, p.moving), Error);
}

}  // namespace
}  // namespace raylign::detail

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/evaluation/poisson.h"
#include "raylign/simulate.h"
#include "tests/support/errors.h"

namespace raylign::detail {
namespace {

// Both methods and their border at 10; 1e5 draws each, bounds of five standard errors.
TEST(Poisson, MeanVarianceAndSkewnessAreRight) {
    for (const double mean : {0.1, 1.0, 9.99, 10.0, 30.0, 1000.0, 1e6, 1e9}) {
        Random random(11);
        constexpr int kDraws = 100000;
        double sum = 0, squares = 0, cubes = 0;
        for (int i = 0; i < kDraws; ++i) {
            const double k = poisson(random, mean);
            ASSERT_TRUE(k >= 0 && k == std::floor(k)) << k;
            const double z = (k - mean) / std::sqrt(mean);
            sum += z;
            squares += z * z;
            cubes += z * z * z;
        }
        const double root = std::sqrt(static_cast<double>(kDraws)), kurtosis = 3 + 1 / mean;
        // Var z^3 = E z^6 - skew^2, E z^6 = 15 + 25 / mean + 1 / mean^2 for a Poisson number.
        const double sixth = 15 + 25 / mean + 1 / (mean * mean), skew = 1 / std::sqrt(mean);
        EXPECT_NEAR(sum / kDraws, 0, 5 / root) << mean;
        EXPECT_NEAR(squares / kDraws, 1, 5 * std::sqrt(kurtosis - 1) / root) << mean;
        EXPECT_NEAR(cubes / kDraws, skew, 5 * std::sqrt(sixth - skew * skew) / root) << mean;
    }
}

/// Pearson's chi^2 against the exact probabilities, cells of at least 20 expected draws.
void expect_poisson_probabilities(double mean) {
    constexpr int kDraws = 200000;
    Random random(12);
    std::vector<int> seen(static_cast<std::size_t>(mean + 20 * std::sqrt(mean) + 50));
    for (int i = 0; i < kDraws; ++i) ++seen.at(static_cast<std::size_t>(poisson(random, mean)));
    double chi2 = 0;
    int cells = 0;
    for (std::size_t k = 0; k < seen.size(); ++k) {
        const double kd = static_cast<double>(k);
        const double expected = kDraws * std::exp(kd * std::log(mean) - mean - std::lgamma(kd + 1));
        if (expected < 20) continue;
        chi2 += (seen[k] - expected) * (seen[k] - expected) / expected;
        ++cells;
    }
    EXPECT_GT(cells, 5);
    EXPECT_NEAR(chi2, cells, 5 * std::sqrt(2.0 * cells)) << "mean " << mean;
}

TEST(Poisson, ProbabilitiesAreExact) {
    for (const double mean : {2.5, 10.0, 12.3, 60.0, 500.0}) expect_poisson_probabilities(mean);
}

// The numbers of a second implementation (Python, with lgamma), which shares no code with this one.
TEST(Poisson, IsTheSameOnEveryMachine) {
    Random random(42);
    std::vector<double> numbers;
    for (const double mean : {0.5, 5.0, 15.0, 100.0, 1e4, 1e8}) numbers.push_back(poisson(random, mean));
    EXPECT_THAT(numbers, testing::ElementsAre(1, 3, 12, 91, 9953, 99990724));
}

TEST(Poisson, ZeroMeanGivesZeroAndBadMeansAreRefused) {
    Random random(1);
    EXPECT_EQ(poisson(random, 0), 0);
    EXPECT_THROW((void)poisson(random, -1), Error);
    EXPECT_THROW((void)poisson(random, std::nan("")), Error);
    EXPECT_THROW((void)poisson(random, 2e15), Error);
}

TEST(PhotonNoise, MeanAndVarianceFollowTheCounts) {
    // I' has mean I + 1 / (2 N) + ... and variance 1 / N + ..., N = photons exp(-I); the rests are O(1 / N^2).
    constexpr double kIntegral = 2, kPhotons = 1e4;
    const double counts = kPhotons * std::exp(-kIntegral);
    const Image noisy = with_photon_noise(Image(300, 300, kIntegral), kPhotons, 7);
    double sum = 0, squares = 0;
    for (const float value : noisy.pixels) {
        sum += value - kIntegral;
        squares += (value - kIntegral) * (value - kIntegral);
    }
    const double pixels = 9e4, sigma = 1 / std::sqrt(counts);
    EXPECT_NEAR(sum / pixels, 1 / (2 * counts), 5 * sigma / std::sqrt(pixels));
    EXPECT_NEAR(squares / pixels, 1 / counts, 5 * std::sqrt(2.0) / counts / std::sqrt(pixels) + 3 / (counts * counts));
}

TEST(PhotonNoise, NoCountsStayFinite) {
    const Image noisy = with_photon_noise(Image(4, 4, 50), 100, 7);
    for (const float value : noisy.pixels) EXPECT_FLOAT_EQ(value, static_cast<float>(std::log(200.0)));
}

TEST(PhotonNoise, SameSeedSameNoise) {
    const Image image(16, 16, 1);
    EXPECT_EQ(with_photon_noise(image, 1e4, 3).pixels, with_photon_noise(image, 1e4, 3).pixels);
    EXPECT_NE(with_photon_noise(image, 1e4, 3).pixels, with_photon_noise(image, 1e4, 4).pixels);
}

TEST(PhotonNoise, RefusesPhotonsOutsideItsRange) {
    for (const double photons : {0.5, 2e9, -1.0, std::nan("")}) {
        EXPECT_THROW((void)with_photon_noise(Image(2, 2), photons, 1), Error) << photons;
    }
}

TEST(PhotonNoise, NamesAPixelThatIsNotFinite) {
    Image image(5, 4, 1);
    image(3, 2) = std::numeric_limits<float>::infinity();
    EXPECT_THAT(test::error_of([&] { (void)with_photon_noise(image, 100, 1); }), testing::HasSubstr("pixel (3, 2)"));
    image(3, 2) = -14;
    EXPECT_THROW((void)with_photon_noise(image, 100, 1), Error);
}

}  // namespace
}  // namespace raylign::detail

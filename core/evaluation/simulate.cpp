#include "raylign/simulate.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/base/error.h"
#include "core/evaluation/poisson.h"

namespace raylign {
using namespace detail;
namespace {

constexpr double kInversionBelow = 10;  // PTRS is valid from 10 on [Hormann93]
constexpr double kLeastIntegral = -13;  // 1e9 exp(13) = 4e14 counts: below 2^53

/// log(k!) for whole k >= 0: by multiplication below 20, then by Stirling's series (next term 1 / (1680 k^7) < 5e-13).
/// std::lgamma would write a global (signgam).
double log_factorial(double k) {
    if (k < 20) {
        double product = 1;
        for (double i = 2; i <= k; ++i) product *= i;
        return std::log(product);
    }
    const double r = 1 / k, r2 = r * r;
    return (k + 0.5) * std::log(k) - k + 0.5 * std::log(2 * std::numbers::pi) +
           r * (1.0 / 12 - r2 * (1.0 / 360 - r2 / 1260));
}

double poisson_by_inversion(Random& random, double mean) {
    double k = 0, probability = std::exp(-mean), rest = random.uniform();
    while (rest >= probability && k < 200) {  // P(k > 200 | mean 10) < 1e-170: only rounding of the tail gets there
        rest -= probability;
        probability *= mean / ++k;
    }
    return k;
}

double poisson_by_rejection(Random& random, double mean) {
    const double b = 0.931 + 2.53 * std::sqrt(mean), a = -0.059 + 0.02483 * b;
    const double inverse_alpha = 1.1239 + 1.1328 / (b - 3.4), v_r = 0.9277 - 3.6224 / (b - 2);
    const double log_mean = std::log(mean);
    for (;;) {
        const double u = random.uniform() - 0.5, v = random.uniform();
        const double us = 0.5 - std::abs(u);
        const double k = std::floor((2 * a / us + b) * u + mean + 0.43);
        if (us >= 0.07 && v <= v_r) return k;
        if (!(k >= 0) || (us < 0.013 && v > us)) continue;
        const double log_hat = std::log(v * inverse_alpha / (a / (us * us) + b));
        if (log_hat <= k * log_mean - mean - log_factorial(k)) return k;
    }
}

}  // namespace

double detail::poisson(Random& random, double mean) {
    if (!(mean >= 0 && mean <= 1e15)) {
        throw bad_value("mean of a Poisson number", std::to_string(mean), "in [0, 1e15]");
    }
    return mean < kInversionBelow ? poisson_by_inversion(random, mean) : poisson_by_rejection(random, mean);
}

Image with_photon_noise(const Image& line_integral, double photons, std::uint64_t seed) {
    if (!(photons >= 1 && photons <= 1e9)) throw bad_value("photons", std::to_string(photons), "in [1, 1e9]");
    Random random(seed);
    Image noisy(line_integral.width, line_integral.height);
    for (std::size_t i = 0; i < noisy.pixels.size(); ++i) {
        const double integral = line_integral.pixels[i];
        if (!(std::isfinite(integral) && integral >= kLeastIntegral)) {
            const std::size_t width = noisy.width;
            throw bad_value("pixel (" + std::to_string(i % width) + ", " + std::to_string(i / width) + ")",
                            std::to_string(integral), "finite and at least -13", "the image to add photon noise to");
        }
        const double counts = poisson(random, photons * std::exp(-integral));
        noisy.pixels[i] = static_cast<float>(-std::log(std::max(counts, 0.5) / photons));
    }
    return noisy;
}

}  // namespace raylign

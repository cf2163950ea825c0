#include "core/similarity/robust_weights.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/error.h"
#include "core/base/median.h"

namespace raylign::detail {
namespace {

constexpr double kTuning = 2.5;
constexpr double kMedianOfNormal = 0.6745, kMedianOfRayleigh = 1.1774;  // of |x| and of sqrt(x^2 + y^2), unit normals

/// Adds the squared residuals of one channel to `squares`, pixel by pixel.
void add_residuals(const Image& fixed, const Image* moving, const Image& weights, std::vector<double>& squares) {
    const MomentSums s = moment_sums(fixed, moving ? *moving : fixed, weights);
    const double fixed_mean = s.fixed / s.weight;
    double gain = 0, moving_mean = 0;
    if (moving && !moving_is_constant(s)) {
        moving_mean = s.moving / s.weight;
        gain = (s.fixed_moving - s.fixed * moving_mean) / (s.moving_moving - s.moving * moving_mean);
        gain = std::max(gain, 0.0);
    }
    for (std::size_t i = 0; i < squares.size(); ++i) {
        double r = fixed.pixels[i] - fixed_mean;
        if (gain > 0) r -= gain * (moving->pixels[i] - moving_mean);
        squares[i] += r * r;
    }
}

}  // namespace

Image robust_weights(const FixedChannels& fixed, std::span<const Image> moving) {
    if (!moving.empty() && moving.size() != fixed.channels.size()) {
        throw bad_value("number of moving channels", std::to_string(moving.size()),
                        std::to_string(fixed.channels.size()) + ", or none");
    }
    const Image& mask = fixed.weights;
    for (const Image& image : moving) {
        if (image.pixels.size() != mask.pixels.size()) throw Error("robust_weights: images of different sizes");
    }
    std::vector<double> squares(mask.pixels.size(), 0.0);
    for (std::size_t c = 0; c < fixed.channels.size(); ++c) {
        add_residuals(fixed.channels[c], moving.empty() ? nullptr : &moving[c], mask, squares);
    }
    std::vector<double> used;
    for (std::size_t i = 0; i < squares.size(); ++i) {
        if (mask.pixels[i] > 0) used.push_back(squares[i]);
    }
    if (used.empty()) throw Error("robust_weights: no pixel has weight");
    const double scale =
        std::sqrt(median(std::move(used))) / (fixed.channels.size() == 1 ? kMedianOfNormal : kMedianOfRayleigh);
    const double cut2 = kTuning * scale * kTuning * scale;

    Image weights(mask.width, mask.height);
    for (std::size_t i = 0; i < squares.size(); ++i) {
        if (!(mask.pixels[i] > 0)) continue;
        const double share = cut2 > 0 ? 1 / (1 + squares[i] / cut2) : 1;
        weights.pixels[i] = static_cast<float>(share * share);
    }
    return weights;
}

}  // namespace raylign::detail

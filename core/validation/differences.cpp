#include "core/validation/differences.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace raylign::detail::validation {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

void Largest::add_many(double largest, double squares, std::size_t count, const std::string& where) {
    const double size = std::isnan(largest) ? kInfinity : std::abs(largest);
    if (size > value_ || count_ == 0) {
        value_ = size;
        where_ = where;
    }
    squares_ += squares;
    count_ += count;
}

double Largest::rms() const { return count_ == 0 ? 0 : std::sqrt(squares_ / static_cast<double>(count_)); }

void add_image(Largest& largest, const Image& other, const Image& oracle, const std::string& where) {
    if (other.width != oracle.width || other.height != oracle.height) {
        largest.add(kInfinity, where + ": another size");
        return;
    }
    double maximum = 0, worst = 0, squares = 0;
    for (const float value : oracle.pixels) maximum = std::max(maximum, std::abs(static_cast<double>(value)));
    const double scale = maximum > 0 ? maximum : 1;
    std::size_t at = 0;
    for (std::size_t i = 0; i < oracle.pixels.size(); ++i) {
        const double difference = std::abs(static_cast<double>(other.pixels[i]) - oracle.pixels[i]) / scale;
        squares += difference * difference;
        if (!(difference <= worst)) {  // NaN is the worst
            worst = difference;
            at = i;
        }
        if (std::isnan(worst)) break;
    }
    largest.add_many(worst, squares, oracle.pixels.size(),
                     where + ", pixel (" + std::to_string(at % oracle.width) + ", " +
                         std::to_string(at / oracle.width) + "): " + std::to_string(other.pixels[at]) + ", oracle " +
                         std::to_string(oracle.pixels[at]));
}

void add_sums(Largest& largest, std::span<const MomentSums> other, std::span<const MomentSums> oracle,
              const std::string& where) {
    for (std::size_t i = 0; i < oracle.size(); ++i) {
        const MomentSums &a = other[i], &b = oracle[i];
        const auto share = [](double difference, double scale) { return difference / (scale > 0 ? scale : 1); };
        const std::string channel = where + ", channel " + std::to_string(i);
        largest.add(share(a.weight - b.weight, b.weight), channel + ", sum of weights");
        largest.add(share(a.moving - b.moving, std::sqrt(b.weight * b.moving_moving)), channel + ", S_B");
        largest.add(share(a.moving_moving - b.moving_moving, b.moving_moving), channel + ", S_BB");
        largest.add(share(a.fixed_moving - b.fixed_moving, std::sqrt(b.fixed_fixed * b.moving_moving)),
                    channel + ", S_AB");
    }
}

double minimum_by_parabola(std::span<const double> offsets, std::span<const double> costs) {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    if (costs.size() < 3 || std::ranges::any_of(costs, [](double c) { return std::isnan(c); })) return kNone;
    const auto k = static_cast<std::size_t>(std::ranges::min_element(costs) - costs.begin());
    if (k == 0 || k + 1 == costs.size()) return kNone;
    const double bend = costs[k - 1] - 2 * costs[k] + costs[k + 1];
    const double shift = bend > 0 ? 0.5 * (costs[k - 1] - costs[k + 1]) / bend : 0;
    return offsets[k] + shift * (offsets[k + 1] - offsets[k]);
}

}  // namespace raylign::detail::validation

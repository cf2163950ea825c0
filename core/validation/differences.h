#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/similarity/linearization.h"
#include "raylign/image.h"

namespace raylign::detail::validation {

/// The largest of many differences, where it was, and their root mean square.
class Largest {
public:
    /// NaN counts as infinitely large.
    void add(double difference, const std::string& where) { add_many(difference, difference * difference, 1, where); }
    /// `count` differences at once: the largest and the sum of their squares.
    void add_many(double largest, double squares, std::size_t count, const std::string& where);
    [[nodiscard]] double value() const { return value_; }
    [[nodiscard]] double rms() const;
    [[nodiscard]] const std::string& where() const { return where_; }

private:
    double value_ = 0, squares_ = 0;
    std::size_t count_ = 0;
    std::string where_;
};

/// Pixel differences as a share of the oracle image's largest pixel.
void add_image(Largest& largest, const Image& other, const Image& oracle, const std::string& where);

/// Differences of the sums as shares of the oracle's: S_B of sqrt(S_w S_BB), S_BB of itself, S_AB of sqrt(S_AA S_BB).
void add_sums(Largest& largest, std::span<const MomentSums> other, std::span<const MomentSums> oracle,
              const std::string& where);

/// Place of the minimum by a parabola through the lowest sample and its neighbours; NaN where it is at an end.
[[nodiscard]] double minimum_by_parabola(std::span<const double> offsets, std::span<const double> costs);

}  // namespace raylign::detail::validation

#pragma once

#include <cstddef>
#include <span>

namespace raylign {

inline constexpr double kNormal95 = 1.959963984540054;  ///< 97.5 % quantile of the standard normal distribution

/// A share of successes and the interval that holds the true one.
struct Proportion {
    std::size_t successes = 0, trials = 0;
    double rate = 0;           ///< successes / trials; 0 without trials
    double low = 0, high = 1;  ///< Wilson score interval
};

/// Wilson's score interval [Wilson27], p = successes / trials:
///   (p + z^2 / 2n -+ z sqrt(p (1 - p) / n + z^2 / 4n^2)) / (1 + z^2 / n).
/// It stays in [0, 1] and says something for 0 and n successes, where the usual p -+ z s is empty: 20 of 20 proves
/// 84 %, 100 of 100 proves 96 %. Without trials: [0, 1]. Throws Error for more successes than trials or z that is not
/// positive.
[[nodiscard]] Proportion wilson_interval(std::size_t successes, std::size_t trials, double z = kNormal95);

/// The value below which the share `share` in [0, 1] of the values lies, linear between order statistics (type 7 of
/// [Hyndman96], the default of R and NumPy). NaN without values. Throws Error for a share outside [0, 1] and
/// for NaN among the values.
[[nodiscard]] double percentile(std::span<const double> values, double share);

/// Over all runs, failed ones included: the tail is where registrations hurt.
struct Percentiles {
    double p50 = 0, p75 = 0, p95 = 0, p99 = 0, max = 0;
};
[[nodiscard]] Percentiles percentiles(std::span<const double> values);

/// Successes of the trials whose initial error lies in [low_mm, high_mm).
struct IntervalSuccess {
    double low_mm = 0, high_mm = 0;
    std::size_t successes = 0, trials = 0;
};

/// Upper end of the last interval up to which every interval reaches the share `wanted` [Kraats05]; 0 where already the
/// first one does not, or has no trials. Intervals in rising order.
[[nodiscard]] double capture_range_mm(std::span<const IntervalSuccess> intervals, double wanted = 0.95);

}  // namespace raylign

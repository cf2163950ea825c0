#include "raylign/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/base/error.h"

namespace raylign {
using namespace detail;
namespace {

std::vector<double> sorted(std::span<const double> values) {
    if (std::ranges::any_of(values, [](double v) { return std::isnan(v); })) {
        throw Error("percentile: the values must not hold NaN");
    }
    std::vector<double> rising(values.begin(), values.end());
    std::ranges::sort(rising);
    return rising;
}

double percentile_of_sorted(const std::vector<double>& rising, double share) {
    if (rising.empty()) return std::numeric_limits<double>::quiet_NaN();
    const double place = share * static_cast<double>(rising.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, rising.size() - 1);
    const double rest = place - static_cast<double>(below);
    // Infinities times zero would be NaN.
    return rest == 0 ? rising[below] : rising[below] + rest * (rising[above] - rising[below]);
}

}  // namespace

Proportion wilson_interval(std::size_t successes, std::size_t trials, double z) {
    if (successes > trials) {
        throw bad_value("successes", std::to_string(successes), "at most " + std::to_string(trials) + ", the trials");
    }
    if (!(z > 0 && std::isfinite(z))) throw bad_value("z", std::to_string(z), "positive and finite");
    Proportion result{successes, trials, 0, 0, 1};
    if (trials == 0) return result;
    const auto n = static_cast<double>(trials);
    const double p = static_cast<double>(successes) / n;
    const double middle = (p + z * z / (2 * n)) / (1 + z * z / n);
    const double half = z * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / (1 + z * z / n);
    result.rate = p;
    result.low = successes == 0 ? 0 : std::max(0.0, middle - half);
    result.high = successes == trials ? 1 : std::min(1.0, middle + half);
    return result;
}

double percentile(std::span<const double> values, double share) {
    if (!(share >= 0 && share <= 1)) throw bad_value("share", std::to_string(share), "in [0, 1]", "percentile");
    return percentile_of_sorted(sorted(values), share);
}

Percentiles percentiles(std::span<const double> values) {
    const std::vector<double> rising = sorted(values);
    const auto at = [&](double share) { return percentile_of_sorted(rising, share); };
    return {at(0.50), at(0.75), at(0.95), at(0.99), at(1)};
}

double capture_range_mm(std::span<const IntervalSuccess> intervals, double wanted) {
    double range_mm = 0;
    for (const IntervalSuccess& interval : intervals) {
        if (interval.trials == 0) break;
        if (static_cast<double>(interval.successes) < wanted * static_cast<double>(interval.trials)) break;
        range_mm = interval.high_mm;
    }
    return range_mm;
}

}  // namespace raylign

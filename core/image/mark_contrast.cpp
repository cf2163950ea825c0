#include "core/image/mark_contrast.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace raylign::detail {
namespace {

constexpr double kContrast = 0.25;    // of the range: white letters on tissue
constexpr double kLogContrast = 0.9;  // a factor of 2.5: lead on bone, where both are dark; cortical bone has 0.6
constexpr double kLogFloor = 0.03;    // of the range: noise in the dark

/// The lowest and the highest of the finite samples around each pixel, `step` apart, up to `window` away along each
/// axis; infinite where there is none.
struct Surroundings {
    std::vector<float> lowest, highest;
};

Surroundings surroundings(const Image& coarse, int window, int step) {
    constexpr float kInfinite = std::numeric_limits<float>::infinity();
    const std::size_t count = coarse.pixels.size();
    Surroundings columns{std::vector<float>(count, kInfinite), std::vector<float>(count, -kInfinite)}, all = columns;
    const auto widen = [](Surroundings& at, std::size_t to, float low, float high) {
        at.lowest[to] = low < at.lowest[to] ? low : at.lowest[to];
        at.highest[to] = high > at.highest[to] ? high : at.highest[to];
    };
    for (int y = 0; y < coarse.height; ++y) {
        for (int v = y - window; v <= y + window; v += step) {
            if (v < 0 || v >= coarse.height) continue;
            const std::size_t from = coarse.index(0, v), to = coarse.index(0, y);
            const auto width = static_cast<std::size_t>(coarse.width);
            for (std::size_t x = 0; x < width; ++x) {
                widen(columns, to + x, coarse.pixels[from + x], coarse.pixels[from + x]);  // NaN widens nothing
            }
        }
        for (int offset = -window; offset <= window; offset += step) {
            const std::size_t row = coarse.index(0, y);
            const int end = std::min(coarse.width, coarse.width - offset);
            for (int x = std::max(0, -offset); x < end; ++x) {
                const std::size_t from = row + static_cast<std::size_t>(x + offset);
                widen(all, row + static_cast<std::size_t>(x), columns.lowest[from], columns.highest[from]);
            }
        }
    }
    return all;
}

/// What a pixel of some value is compared by.
struct Bounds {
    double least, floor;  ///< a mark's difference; what is added to both sides of a ratio
    double outline_ratio = std::exp(kSurely * kOutlineContrast * kLogContrast);

    [[nodiscard]] double contrast(double value, double other) const {
        const double log_contrast = std::log((std::max(value, 0.0) + floor) / (std::max(other, 0.0) + floor));
        return std::max(std::abs(value - other) / least, std::abs(log_contrast) / kLogContrast);
    }
    /// Between these, what it is compared with is surely no more than an outline away.
    [[nodiscard]] double low(double value) const {
        const double bright = std::max(value, 0.0) + floor;
        return std::max(value - kSurely * kOutlineContrast * least, bright / outline_ratio - floor);
    }
    [[nodiscard]] double high(double value) const {
        const double bright = std::max(value, 0.0) + floor;
        return std::min(value + kSurely * kOutlineContrast * least, bright * outline_ratio - floor);
    }
    static constexpr double kSurely = 1 - 1e-6;  // rounding must not decide
};

/// The finite samples around a pixel; how many are above and below what is near its value.
struct Samples {
    std::vector<float> values;
    std::size_t below = 0, above = 0;

    void take(const Image& image, std::size_t pixel, int window, int step, double low, double high) {
        values.clear();
        below = above = 0;
        const int x = static_cast<int>(pixel) % image.width, y = static_cast<int>(pixel) / image.width;
        for (int v = y - window; v <= y + window; v += step) {
            if (v < 0 || v >= image.height) continue;
            for (int u = x - window; u <= x + window; u += step) {
                if (u < 0 || u >= image.width || !std::isfinite(image(u, v))) continue;
                const float value = image(u, v);
                values.push_back(value);
                below += value < low;
                above += value > high;
            }
        }
    }
    /// The median is neither below nor above.
    [[nodiscard]] bool has_median_near() const {
        const std::size_t middle = values.size() / 2;
        return below <= middle && above < values.size() - middle;
    }
};

}  // namespace

std::vector<double> mark_contrast(const Image& image, double range, int window) {
    const Bounds bounds{kContrast * range, kLogFloor * range};
    const int step = std::max(1, window / 4);  // 9 x 9 samples tell the median well enough
    const Surroundings known = surroundings(image, window, step);
    std::vector<double> contrast(image.pixels.size());
    Samples around;
    for (std::size_t i = 0; i < contrast.size(); ++i) {
        const double value = image.pixels[i];
        if (!std::isfinite(value)) continue;
        const double low = bounds.low(value), high = bounds.high(value);
        if (known.lowest[i] >= low && known.highest[i] <= high) continue;
        around.take(image, i, window, step, low, high);
        if (around.values.empty() || around.has_median_near()) continue;
        const auto middle = around.values.begin() + static_cast<std::ptrdiff_t>(around.values.size() / 2);
        std::nth_element(around.values.begin(), middle, around.values.end());
        contrast[i] = bounds.contrast(value, *middle);
    }
    return contrast;
}

}  // namespace raylign::detail

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
    double outline_ratio = std::exp(kSurely * kOutlineContrast * kLogContrast), inverse_ratio = 1 / outline_ratio;

    [[nodiscard]] double contrast(double value, double other) const {
        const double log_contrast = std::log((std::max(value, 0.0) + floor) / (std::max(other, 0.0) + floor));
        return std::max(std::abs(value - other) / least, std::abs(log_contrast) / kLogContrast);
    }
    /// Between these, what it is compared with is surely no more than an outline away.
    [[nodiscard]] double low(double value) const {
        const double bright = std::max(value, 0.0) + floor;
        return std::max(value - kSurely * kOutlineContrast * least, bright * inverse_ratio - floor);
    }
    [[nodiscard]] double high(double value) const {
        const double bright = std::max(value, 0.0) + floor;
        return std::min(value + kSurely * kOutlineContrast * least, bright * outline_ratio - floor);
    }
    static constexpr double kSurely = 1 - 1e-6;  // rounding must not decide
};

/// The float that other floats compare with as with the number: the next one up, or down.
float at_least(double value) {
    const auto nearest = static_cast<float>(value);
    return nearest < value ? std::nextafter(nearest, std::numeric_limits<float>::infinity()) : nearest;
}
float at_most(double value) { return -at_least(-value); }

/// The image's finite pixels in a margin of NaN, so that the samples of a window's row lie one beside the other.
class Lattice {
public:
    Lattice(const Image& image, int window, int step)
        : step_(step),
          length_((image.width + 2 * window + step - 1) / step),
          pixels_(static_cast<std::size_t>(image.height + 2 * window) * static_cast<std::size_t>(step * length_),
                  std::numeric_limits<float>::quiet_NaN()) {
        for (int y = 0; y < image.height; ++y) {
            for (int x = 0; x < image.width; ++x) {
                if (std::isfinite(image(x, y))) pixels_[place(x + window, y + window)] = image(x, y);
            }
        }
    }
    /// The samples of the k-th row of the window around a pixel.
    [[nodiscard]] const float* row(int x, int y, int k) const { return pixels_.data() + place(x, y + k * step_); }

private:
    [[nodiscard]] std::size_t place(int x, int y) const {
        return static_cast<std::size_t>(y * step_ + x % step_) * static_cast<std::size_t>(length_) +
               static_cast<std::size_t>(x / step_);
    }

    int step_, length_;
    std::vector<float> pixels_;  ///< [row][column mod step][column / step]
};

/// The finite samples around a pixel: how many there are, and how many of them are above and below what is near it.
struct Samples {
    int count = 0, below = 0, above = 0;

    Samples(const Lattice& lattice, int x, int y, int across, float low, float high) {
        for (int k = 0; k < across; ++k) {
            const float* row = lattice.row(x, y, k);
            for (int i = 0; i < across; ++i) {  // NaN is none of these
                count += row[i] == row[i];
                below += row[i] < low;
                above += row[i] > high;
            }
        }
    }
    /// The median is neither below nor above.
    [[nodiscard]] bool has_median_near() const {
        const int middle = count / 2;
        return below <= middle && above < count - middle;
    }
};

float median_around(const Lattice& lattice, int x, int y, int across, std::vector<float>& values) {
    values.clear();
    for (int k = 0; k < across; ++k) {
        const float* row = lattice.row(x, y, k);
        std::copy_if(row, row + across, std::back_inserter(values), [](float value) { return value == value; });
    }
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

}  // namespace

std::vector<double> mark_contrast(const Image& image, double range, int window) {
    const Bounds bounds{kContrast * range, kLogFloor * range};
    const int step = std::max(1, window / 4);  // 9 x 9 samples tell the median well enough
    const Surroundings known = surroundings(image, window, step);
    const Lattice lattice(image, window, step);
    const int across = 2 * window / step + 1;
    std::vector<double> contrast(image.pixels.size());
    std::vector<float> values;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const std::size_t i = image.index(x, y);
            const double value = image.pixels[i];
            if (!std::isfinite(value)) continue;
            const double low = bounds.low(value), high = bounds.high(value);
            if (known.lowest[i] >= low && known.highest[i] <= high) continue;
            const Samples around(lattice, x, y, across, at_least(low), at_most(high));
            if (around.count == 0 || around.has_median_near()) continue;
            contrast[i] = bounds.contrast(value, median_around(lattice, x, y, across, values));
        }
    }
    return contrast;
}

}  // namespace raylign::detail

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

}  // namespace

std::vector<double> mark_contrast(const Image& coarse, double range, int window) {
    const double least = kContrast * range, floor = kLogFloor * range;
    const int step = std::max(1, window / 4);  // 9 x 9 samples tell the median well enough
    const Surroundings known = surroundings(coarse, window, step);
    const auto contrast_to = [&](double value, double other) {
        const double log_contrast = std::log((std::max(value, 0.0) + floor) / (std::max(other, 0.0) + floor));
        return std::max(std::abs(value - other) / least, std::abs(log_contrast) / kLogContrast);
    };
    std::vector<double> contrast(coarse.pixels.size());
    std::vector<float> around;
    for (std::size_t i = 0; i < contrast.size(); ++i) {
        const double value = coarse.pixels[i];
        if (!std::isfinite(value)) continue;
        // It grows with the distance from the value on either side, and the median lies between the two.
        if (contrast_to(value, known.lowest[i]) <= kOutlineContrast &&
            contrast_to(value, known.highest[i]) <= kOutlineContrast) {
            continue;
        }
        const int x = static_cast<int>(i) % coarse.width, y = static_cast<int>(i) / coarse.width;
        around.clear();
        for (int v = y - window; v <= y + window; v += step) {
            for (int u = x - window; u <= x + window; u += step) {
                if (u < 0 || v < 0 || u >= coarse.width || v >= coarse.height) continue;
                if (std::isfinite(coarse(u, v))) around.push_back(coarse(u, v));
            }
        }
        if (around.empty()) continue;
        const auto middle = around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2);
        std::nth_element(around.begin(), middle, around.end());
        contrast[i] = contrast_to(value, *middle);
    }
    return contrast;
}

}  // namespace raylign::detail

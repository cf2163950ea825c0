#include "core/image/gradient_filter.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/error.h"

namespace raylign::detail {
namespace {

/// sum_k taps[k] rows[k](x) for a row of pixels, k = -radius .. radius. Double sums, float result. Taps k and -k are
/// added as a pair: those of a derivative cancel exactly where the image does not change, and no rounding is left that
/// would pass for a channel to compare. Pair by pair over the whole row, as that takes several pixels at once.
template <class Row>
void correlate_row(const Row& row, const std::vector<double>& taps, std::vector<double>& sums, float* out) {
    const int radius = static_cast<int>(taps.size() / 2), width = static_cast<int>(sums.size());
    const float* middle = row(0);
    for (int x = 0; x < width; ++x) sums[x] = taps[radius] * middle[x];
    for (int k = 1; k <= radius; ++k) {
        const float *after = row(k), *before = row(-k);
        const double tap_after = taps[radius + k], tap_before = taps[radius - k];
        for (int x = 0; x < width; ++x) sums[x] += tap_after * after[x] + tap_before * before[x];
    }
    for (int x = 0; x < width; ++x) out[x] = static_cast<float>(sums[x]);
}

/// Correlates along x; beyond the image its outermost pixels repeat.
Image correlate_along_x(const Image& in, const std::vector<double>& taps) {
    const int radius = static_cast<int>(taps.size() / 2);
    Image out(in.width, in.height);
    std::vector<float> padded(in.width + 2 * radius);
    std::vector<double> sums(in.width);
    for (int y = 0; y < in.height; ++y) {
        const float* pixels = &in.pixels[in.index(0, y)];
        std::fill_n(padded.begin(), radius, pixels[0]);
        std::copy_n(pixels, in.width, padded.begin() + radius);
        std::fill_n(padded.begin() + radius + in.width, radius, pixels[in.width - 1]);
        correlate_row([&](int k) { return &padded[radius + k]; }, taps, sums, &out.pixels[out.index(0, y)]);
    }
    return out;
}

/// Correlates along y, likewise.
Image correlate_along_y(const Image& in, const std::vector<double>& taps) {
    Image out(in.width, in.height);
    std::vector<double> sums(in.width);
    for (int y = 0; y < in.height; ++y) {
        correlate_row([&](int k) { return &in.pixels[in.index(0, std::clamp(y + k, 0, in.height - 1))]; }, taps, sums,
                      &out.pixels[out.index(0, y)]);
    }
    return out;
}

}  // namespace

GradientTaps gradient_taps(const GradientFilter& filter) {
    if (!(filter.sigma_px > 0 && filter.sigma_px <= 32)) {
        throw bad_value("sigma_px", std::to_string(filter.sigma_px), "in (0, 32]", "the gradient filter");
    }
    if (filter.radius_px < 1 || filter.radius_px > 64) {
        throw bad_value("radius_px", std::to_string(filter.radius_px), "in [1, 64]", "the gradient filter");
    }
    GradientTaps taps{filter.radius_px, {}, {}};
    double smooth_sum = 0, slope = 0;
    for (int k = -filter.radius_px; k <= filter.radius_px; ++k) {
        const double g = std::exp(-0.5 * k * k / (filter.sigma_px * filter.sigma_px));
        taps.smooth.push_back(g);
        taps.derivative.push_back(k * g);
        smooth_sum += g;
        slope += k * k * g;
    }
    for (double& tap : taps.smooth) tap /= smooth_sum;
    for (double& tap : taps.derivative) tap /= slope;
    return taps;
}

std::array<Image, 2> gradient_images(const Image& image, const GradientTaps& taps) {
    if (image.empty()) return {image, image};
    return {correlate_along_y(correlate_along_x(image, taps.derivative), taps.smooth),
            correlate_along_y(correlate_along_x(image, taps.smooth), taps.derivative)};
}

namespace {

constexpr int kNever = -(1 << 29);  // where the last zero was before there was one

/// Sets 0 every pixel of `out` in whose row `in` has a zero within `radius`.
void erode_along_x(const Image& in, int radius, Image& out) {
    for (int y = 0; y < in.height; ++y) {
        const float* row = &in.pixels[in.index(0, y)];
        float* eroded = &out.pixels[out.index(0, y)];
        int last = kNever;
        for (int x = 0; x < in.width; ++x) {
            if (row[x] == 0) last = x;
            if (x - last <= radius) eroded[x] = 0;
        }
        last = -kNever;
        for (int x = in.width; x-- > 0;) {
            if (row[x] == 0) last = x;
            if (last - x <= radius) eroded[x] = 0;
        }
    }
}

/// The same of columns, row by row.
void erode_along_y(const Image& in, int radius, Image& out) {
    const auto sweep = [&](int y, std::vector<int>& since, int now) {
        const float* row = &in.pixels[in.index(0, y)];
        float* eroded = &out.pixels[out.index(0, y)];
        for (int x = 0; x < in.width; ++x) {
            if (row[x] == 0) since[x] = now;
            if (now - since[x] <= radius) eroded[x] = 0;
        }
    };
    std::vector<int> above(in.width, kNever), below(in.width, kNever);
    for (int y = 0; y < in.height; ++y) sweep(y, above, y);
    for (int y = in.height; y-- > 0;) sweep(y, below, in.height - 1 - y);
}

}  // namespace

Image erode_weights(const Image& weights, int radius_px) {
    Image rows = weights;
    erode_along_x(weights, radius_px, rows);
    Image out = weights;
    erode_along_y(rows, radius_px, out);
    return out;
}

}  // namespace raylign::detail

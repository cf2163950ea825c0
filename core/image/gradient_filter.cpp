#include "core/image/gradient_filter.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/error.h"

namespace raylign::detail {
namespace {

constexpr int kLanes = 4;        // pixels whose sums stay in registers
constexpr int kStripWidth = 32;  // columns filtered at once: rows of both filters stay in the L2 cache
using Lanes = Eigen::Array<double, kLanes, 1>;

Lanes lanes_at(const double* values) { return Eigen::Map<const Lanes>(values); }

/// Some columns of an image, filtered along x by either filter. Doubles, rows of kStripWidth.
struct FilteredRows {
    std::vector<double> smooth, derivative;

    [[nodiscard]] static std::size_t at(int x, int y) { return static_cast<std::size_t>(y) * kStripWidth + x; }
};

/// Of the columns from x0 on; beyond the image its outermost pixels repeat. Pixels k and -k are taken together: where
/// the image does not change they cancel exactly, and no rounding is left that would pass for a channel to compare.
void filter_along_x(const Image& in, int x0, const GradientTaps& taps, FilteredRows& out) {
    const int radius = taps.radius_px;
    std::vector<double> padded(kStripWidth + 2 * static_cast<std::size_t>(radius));
    const double *smooth = &taps.smooth[radius], *derivative = &taps.derivative[radius];
    for (int y = 0; y < in.height; ++y) {
        const float* row = &in.pixels[in.index(0, y)];
        for (int i = 0; i < std::ssize(padded); ++i) padded[i] = row[std::clamp(x0 - radius + i, 0, in.width - 1)];
        for (int x = 0; x < kStripWidth; x += kLanes) {
            const double* middle = &padded[radius + x];
            Lanes smoothed = smooth[0] * lanes_at(middle), derived = Lanes::Zero();
            for (int k = 1; k <= radius; ++k) {
                const Lanes after = lanes_at(middle + k), before = lanes_at(middle - k);
                smoothed += smooth[k] * (after + before);
                derived += derivative[k] * (after - before);
            }
            Eigen::Map<Lanes>(&out.smooth[FilteredRows::at(x, y)]) = smoothed;
            Eigen::Map<Lanes>(&out.derivative[FilteredRows::at(x, y)]) = derived;
        }
    }
}

/// Filters the same columns along y, each by the other filter, likewise.
void filter_along_y(const FilteredRows& in, int x0, const GradientTaps& taps, std::array<Image, 2>& gradients) {
    const int radius = taps.radius_px, height = gradients[0].height, width = gradients[0].width;
    const double *smooth = &taps.smooth[radius], *derivative = &taps.derivative[radius];
    const int end = std::min(kStripWidth, width - x0);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < end; x += kLanes) {
            Lanes along_x = smooth[0] * lanes_at(&in.derivative[FilteredRows::at(x, y)]), along_y = Lanes::Zero();
            for (int k = 1; k <= radius; ++k) {
                const std::size_t after = FilteredRows::at(x, std::min(y + k, height - 1));
                const std::size_t before = FilteredRows::at(x, std::max(y - k, 0));
                along_x += smooth[k] * (lanes_at(&in.derivative[after]) + lanes_at(&in.derivative[before]));
                along_y += derivative[k] * (lanes_at(&in.smooth[after]) - lanes_at(&in.smooth[before]));
            }
            for (int i = 0; i < std::min(kLanes, end - x); ++i) {
                gradients[0](x0 + x + i, y) = static_cast<float>(along_x[i]);
                gradients[1](x0 + x + i, y) = static_cast<float>(along_y[i]);
            }
        }
    }
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
    const std::size_t in_strip = FilteredRows::at(0, image.height);
    FilteredRows rows{std::vector<double>(in_strip), std::vector<double>(in_strip)};
    std::array<Image, 2> gradients{Image(image.width, image.height), Image(image.width, image.height)};
    for (int x0 = 0; x0 < image.width; x0 += kStripWidth) {
        filter_along_x(image, x0, taps, rows);
        filter_along_y(rows, x0, taps, gradients);
    }
    return gradients;
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

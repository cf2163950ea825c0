#include "core/image/gradient_filter.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.h"

namespace raylign {
namespace {

/// out(x, y) = sum_k taps[k] in(x + k dx, y + k dy), coordinates clamped to the image. Double sums, float result. Taps
/// k and -k are added as a pair: those of a derivative cancel exactly where the image does not change, and no rounding
/// is left that would pass for a channel to compare.
Image correlate(const Image& in, const std::vector<double>& taps, int dx, int dy) {
    const int radius = static_cast<int>(taps.size() / 2);
    Image out(in.width, in.height);
    for (int y = 0; y < in.height; ++y) {
        for (int x = 0; x < in.width; ++x) {
            const auto weighted = [&](int k) {
                return taps[k + radius] *
                       in(std::clamp(x + k * dx, 0, in.width - 1), std::clamp(y + k * dy, 0, in.height - 1));
            };
            double sum = weighted(0);
            for (int k = 1; k <= radius; ++k) sum += weighted(k) + weighted(-k);
            out(x, y) = static_cast<float>(sum);
        }
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
    return {correlate(correlate(image, taps.derivative, 1, 0), taps.smooth, 0, 1),
            correlate(correlate(image, taps.smooth, 1, 0), taps.derivative, 0, 1)};
}

Image erode_weights(const Image& weights, int radius_px) {
    const auto zero_nearby = [](const Image& in, int x, int y, int radius, bool along_x) {
        for (int k = -radius; k <= radius; ++k) {
            const int px = along_x ? x + k : x, py = along_x ? y : y + k;
            if (px >= 0 && py >= 0 && px < in.width && py < in.height && in(px, py) == 0) return true;
        }
        return false;
    };
    Image rows = weights, out = weights;
    for (const bool along_x : {true, false}) {
        const Image& in = along_x ? weights : rows;
        Image& result = along_x ? rows : out;
        for (int y = 0; y < in.height; ++y) {
            for (int x = 0; x < in.width; ++x) {
                result(x, y) = zero_nearby(in, x, y, radius_px, along_x) ? 0 : weights(x, y);
            }
        }
    }
    return out;
}

}  // namespace raylign

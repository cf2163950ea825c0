#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/evaluation/xray_parts.h"
#include "core/image/smooth.h"

namespace raylign::detail {
namespace {

/// Taps 0 to n; the sum over both sides is 1.
std::vector<double> gaussian_taps(double sigma_px) {
    const int reach = static_cast<int>(std::ceil(4 * sigma_px + 0.5));
    std::vector<double> taps;
    const double scale = 1 / (sigma_px * std::numbers::sqrt2);
    for (int i = 0; i <= reach; ++i) taps.push_back(std::erf((i + 0.5) * scale) - std::erf((i - 0.5) * scale));
    double sum = taps[0];
    for (int i = 1; i <= reach; ++i) sum += 2 * taps[i];
    for (double& tap : taps) tap /= sum;
    return taps;
}

/// Along x; the result is transposed, so that twice is both axes.
Image blurred_and_transposed(const Image& image, double sigma_px) {
    Image result(image.height, image.width);
    const std::vector<double> taps = sigma_px > 0 ? gaussian_taps(sigma_px) : std::vector<double>{1};
    for (int y = 0; y < image.height; ++y) {
        const auto at = [&](int x) -> double { return image(std::clamp(x, 0, image.width - 1), y); };
        for (int x = 0; x < image.width; ++x) {
            double sum = taps[0] * at(x);
            for (int i = 1; i < static_cast<int>(taps.size()); ++i) sum += taps[i] * (at(x - i) + at(x + i));
            result(y, x) = static_cast<float>(sum);
        }
    }
    return result;
}

}  // namespace

Image blurred(const Image& image, const Eigen::Vector2d& sigma_px) {
    return blurred_and_transposed(blurred_and_transposed(image, sigma_px.x()), sigma_px.y());
}

Image spread_out(const Image& image, double sigma_px) {
    const double sigma = std::clamp(sigma_px, 1.0, 1000.0);
    const int margin = static_cast<int>(std::ceil(3 * sigma)) + 4;  // the reach of three boxes of this sigma
    Image wide(image.width + 2 * margin, image.height + 2 * margin);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) wide(x + margin, y + margin) = image(x, y);
    }
    wide = smoothed(wide, sigma);
    Image result(image.width, image.height);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) result(x, y) = wide(x + margin, y + margin);
    }
    return result;
}

Image binned(const Image& samples, int k) {
    Image result(samples.width / k, samples.height / k);
    for (int y = 0; y < result.height; ++y) {
        for (int x = 0; x < result.width; ++x) {
            double sum = 0;
            for (int j = 0; j < k * k; ++j) sum += samples(k * x + j % k, k * y + j / k);
            result(x, y) = static_cast<float>(sum / (k * k));
        }
    }
    return result;
}

}  // namespace raylign::detail

#include "core/image/smooth.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "core/base/error.h"

namespace raylign::detail {
namespace {

/// Pixels of a direction: `lines` lines of `length` values.
struct Lines {
    int lines, length;
    std::ptrdiff_t line_stride, stride;
};

void box_filter(std::vector<double>& values, const Lines& d, int r) {
    std::vector<double> line(d.length);
    const auto value = [&](int i) { return line[std::clamp(i, 0, d.length - 1)]; };
    for (int l = 0; l < d.lines; ++l) {
        double* at = values.data() + l * d.line_stride;
        for (int i = 0; i < d.length; ++i) line[i] = at[i * d.stride];
        double sum = 0;
        for (int i = -r; i <= r; ++i) sum += value(i);
        for (int i = 0; i < d.length; ++i) {
            at[i * d.stride] = sum / (2 * r + 1);
            sum += value(i + r + 1) - value(i - r);
        }
    }
}

}  // namespace

Image smoothed(const Image& image, double sigma_px) {
    if (!(sigma_px >= 1 && sigma_px <= 1000))
        throw bad_value("sigma", std::to_string(sigma_px) + " px", "in [1, 1000]");
    const int r = std::max(1, static_cast<int>(std::lround((std::sqrt(4 * sigma_px * sigma_px + 1) - 1) / 2)));
    std::vector<double> values(image.pixels.begin(), image.pixels.end());
    for (int pass = 0; pass < 3; ++pass) {
        box_filter(values, {image.height, image.width, image.width, 1}, r);
        box_filter(values, {image.width, image.height, 1, image.width}, r);
    }
    Image result(image.width, image.height);
    std::ranges::transform(values, result.pixels.begin(), [](double v) { return static_cast<float>(v); });
    return result;
}

}  // namespace raylign::detail

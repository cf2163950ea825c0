#include "apps/pictures/picture.h"

#include <algorithm>
#include <cmath>

#include "apps/pictures/bitmap_font.h"
#include "core/image/gradient_filter.h"

namespace raylign::detail::apps {
namespace {

void set_pixel(RgbImage& picture, int x, int y, Colour colour) {
    if (x < 0 || y < 0 || x >= picture.width || y >= picture.height) return;
    picture.pixels[static_cast<std::size_t>(y) * picture.width + x] = colour;
}

Image halved(const Image& image) {
    Image half(std::max(image.width / 2, 1), std::max(image.height / 2, 1));
    for (int y = 0; y < half.height; ++y) {
        for (int x = 0; x < half.width; ++x) {
            const int x1 = std::min(2 * x + 1, image.width - 1), y1 = std::min(2 * y + 1, image.height - 1);
            half(x, y) = (image(2 * x, 2 * y) + image(x1, 2 * y) + image(2 * x, y1) + image(x1, y1)) / 4;
        }
    }
    return half;
}

/// Weights of the four samples around a place that lies `t` in [0, 1) after the second: Catmull-Rom spline [1974].
std::array<double, 4> cubic_weights(double t) {
    const double t2 = t * t, t3 = t2 * t;
    return {(-t3 + 2 * t2 - t) / 2, (3 * t3 - 5 * t2 + 2) / 2, (-3 * t3 + 4 * t2 + t) / 2, (t3 - t2) / 2};
}

/// Enlarges along x; the result is transposed, so that two calls enlarge both ways.
Image enlarged_and_transposed(const Image& image, int factor) {
    Image large(image.height, image.width * factor);
    for (int x = 0; x < large.height; ++x) {
        const double place = (x + 0.5) / factor - 0.5;
        const int left = static_cast<int>(std::floor(place));
        const std::array<double, 4> weights = cubic_weights(place - left);
        for (int y = 0; y < image.height; ++y) {
            double sum = 0;
            for (int k = 0; k < 4; ++k) sum += weights[k] * image(std::clamp(left - 1 + k, 0, image.width - 1), y);
            large(y, x) = static_cast<float>(sum);
        }
    }
    return large;
}

/// Correlation with symmetric taps along x; the result is transposed, so that two calls smooth both ways.
Image smoothed_and_transposed(const Image& image, const std::vector<double>& taps, int radius) {
    Image result(image.height, image.width);
    std::vector<float> row(image.width + 2 * radius), sums(image.width);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width + 2 * radius; ++x)
            row[x] = image(std::clamp(x - radius, 0, image.width - 1), y);
        std::ranges::fill(sums, 0.F);
        for (int k = 0; k <= 2 * radius; ++k) {  // tap by tap, as that takes several pixels at once
            const auto tap = static_cast<float>(taps[k]);
            for (int x = 0; x < image.width; ++x) sums[x] += tap * row[x + k];
        }
        for (int x = 0; x < image.width; ++x) result(y, x) = sums[x];
    }
    return result;
}

}  // namespace

Window robust_window(const Image& image, const Image& weights) {
    std::vector<float> values;
    values.reserve(image.pixels.size());
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        if ((weights.empty() || weights.pixels[i] > 0) && std::isfinite(image.pixels[i]))
            values.push_back(image.pixels[i]);
    }
    if (values.empty()) return {};
    const auto quantile = [&](double share) {
        const auto place = values.begin() + std::lround(share * static_cast<double>(values.size() - 1));
        std::nth_element(values.begin(), place, values.end());
        return static_cast<double>(*place);
    };
    const Window window{quantile(0.01), quantile(0.99)};
    return window.high > window.low ? window : Window{window.low - 0.5, window.low + 0.5};
}

double through_window(double value, const Window& window) {
    const double share = (value - window.low) / (window.high - window.low);
    return share > 0 ? std::min(share, 1.0) : 0.0;  // NaN becomes 0
}

Image enlarged(const Image& image, int factor) {
    return enlarged_and_transposed(enlarged_and_transposed(image, factor), factor);
}

Image smoothed(const Image& image, double sigma_px) {
    const int radius = std::clamp(static_cast<int>(std::ceil(2.5 * sigma_px)), 1, 64);
    const std::vector<double> taps = gradient_taps({.sigma_px = sigma_px, .radius_px = radius}).smooth;
    return smoothed_and_transposed(smoothed_and_transposed(image, taps, radius), taps, radius);
}

Image shrunk_to(const Image& image, int longest_px) {
    Image small = image;
    while (std::max(small.width, small.height) > longest_px) small = halved(small);
    return small;
}

RgbImage blank(int width, int height, Colour colour) {
    return {width, height, std::vector<Colour>(static_cast<std::size_t>(width) * height, colour)};
}

RgbImage grey_picture(const Image& image, const Window& window) {
    RgbImage picture = blank(image.width, image.height, {});
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        picture.pixels[i].fill(static_cast<std::uint8_t>(std::lround(255 * through_window(image.pixels[i], window))));
    }
    return picture;
}

void paste(RgbImage& picture, const RgbImage& tile, int x, int y) {
    for (int ty = 0; ty < tile.height; ++ty) {
        for (int tx = 0; tx < tile.width; ++tx) {
            set_pixel(picture, x + tx, y + ty, tile.pixels[static_cast<std::size_t>(ty) * tile.width + tx]);
        }
    }
}

void fill(RgbImage& picture, int x, int y, int width, int height, Colour colour) {
    for (int py = y; py < y + height; ++py) {
        for (int px = x; px < x + width; ++px) set_pixel(picture, px, py, colour);
    }
}

void draw_text(RgbImage& picture, std::string_view text, int x, int y, int scale, Colour colour) {
    for (std::size_t i = 0; i < text.size(); ++i) {
        const int left = x + static_cast<int>(i) * kGlyphAdvance * scale;
        for (int row = 0; row < kGlyphHeight; ++row) {
            for (int column = 0; column < kGlyphWidth; ++column) {
                if (!glyph_bit(text[i], column, row)) continue;
                fill(picture, left + column * scale, y + row * scale, scale, scale, colour);
            }
        }
    }
}

}  // namespace raylign::detail::apps

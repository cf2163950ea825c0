#include "core/registration/trust/distortion.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/image/smooth.h"

namespace raylign::detail {
namespace {

constexpr double kScatter = 0.4, kScatterWidth = 0.1, kHardening = 0.06;
constexpr double kBlur_px = 0.6;

Image arriving(Image integral) {
    for (float& pixel : integral.pixels) pixel = std::exp(-pixel);
    return integral;
}

Image integral_of(Image arriving) {
    for (float& pixel : arriving.pixels) pixel = -std::log(std::max(pixel, 1e-30F));
    return arriving;
}

/// Gaussian of half a pixel as three taps with its variance.
Image blurred(const Image& integral) {
    const Image in = arriving(integral);
    constexpr auto side = static_cast<float>(kBlur_px * kBlur_px / 2);
    Image rows = in, out = in;
    for (int y = 0; y < in.height; ++y) {
        for (int x = 1; x + 1 < in.width; ++x) {
            rows(x, y) = side * (in(x - 1, y) + in(x + 1, y)) + (1 - 2 * side) * in(x, y);
        }
    }
    out = rows;
    for (int y = 1; y + 1 < in.height; ++y) {
        for (int x = 0; x < in.width; ++x) {
            out(x, y) = side * (rows(x, y - 1) + rows(x, y + 1)) + (1 - 2 * side) * rows(x, y);
        }
    }
    return integral_of(std::move(out));
}

Image scattered(const Image& integral) {
    Image primary = arriving(integral);
    const Image wide = smoothed(primary, std::clamp(kScatterWidth * primary.width, 1.0, 1000.0));
    for (std::size_t i = 0; i < primary.pixels.size(); ++i) {
        primary.pixels[i] = static_cast<float>((primary.pixels[i] + kScatter * wide.pixels[i]) / (1 + kScatter));
    }
    return integral_of(std::move(primary));
}

Image hardened(Image integral) {
    for (float& pixel : integral.pixels) pixel /= 1 + static_cast<float>(kHardening) * std::max(pixel, 0.F);
    return integral;
}

}  // namespace

std::string_view distortion_name(Distortion distortion) {
    constexpr std::array<std::string_view, kDistortions> kNames{"blur", "scatter", "hardening"};
    return kNames.at(static_cast<std::size_t>(distortion));
}

Image distorted(Distortion distortion, const Image& drr) {
    switch (distortion) {
        case Distortion::blur:
            return blurred(drr);
        case Distortion::scatter:
            return scattered(drr);
        case Distortion::hardening:
            return hardened(drr);
    }
    return drr;
}

}  // namespace raylign::detail

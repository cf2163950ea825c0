#include "apps/pictures/edges.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <numeric>

#include "apps/pictures/picture.h"
#include "core/image/gradient_filter.h"

namespace raylign::detail::apps {
namespace {

constexpr double kNeighbourhoodShare = 0.08;  // of the image's width: a few vertebrae

float bilinear(const Image& image, double x, double y) {
    const double cx = std::clamp(x, 0.0, image.width - 1.0), cy = std::clamp(y, 0.0, image.height - 1.0);
    const int x0 = static_cast<int>(cx), y0 = static_cast<int>(cy);
    const int x1 = std::min(x0 + 1, image.width - 1), y1 = std::min(y0 + 1, image.height - 1);
    const double top = std::lerp(image(x0, y0), image(x1, y0), cx - x0);
    const double bottom = std::lerp(image(x0, y1), image(x1, y1), cx - x0);
    return static_cast<float>(std::lerp(top, bottom, cy - y0));
}

std::uint8_t sector_of(double dx, double dy) {
    const double eighths = std::atan2(dy, dx) * 4 / std::numbers::pi;  // in [-4, 4]
    return static_cast<std::uint8_t>((std::lround(eighths) + 8) % 8 + 1);
}

/// 1 / (mean of |gradient| around + half of its mean over the image): the second term keeps flat parts flat.
Image local_gain(const Image& gx, const Image& gy) {
    Image magnitude(gx.width, gx.height);
    for (std::size_t i = 0; i < magnitude.pixels.size(); ++i)
        magnitude.pixels[i] = std::hypot(gx.pixels[i], gy.pixels[i]);
    const double sum = std::accumulate(magnitude.pixels.begin(), magnitude.pixels.end(), 0.0);
    const auto floor = static_cast<float>(sum / (2 * static_cast<double>(magnitude.pixels.size())));
    Image gain = smoothed(magnitude, std::clamp(kNeighbourhoodShare * gx.width, 0.5, 32.0));
    for (float& value : gain.pixels) value = value + floor > 0 ? 1 / (value + floor) : 0;
    return gain;
}

float seed_threshold(const Image& ridges, double kept_share) {
    std::vector<float> strengths;
    std::ranges::copy_if(ridges.pixels, std::back_inserter(strengths), [](float v) { return v > 0; });
    if (strengths.empty()) return 0;
    const auto place = strengths.begin() + static_cast<std::ptrdiff_t>((1 - kept_share) * (strengths.size() - 1));
    std::nth_element(strengths.begin(), place, strengths.end());
    return *place;
}

/// The ridge pixels of strength >= low that hang together (8 neighbours) with (x, y); taken out of `ridges`.
std::vector<std::size_t> take_contour(Image& ridges, int x, int y, float low) {
    std::vector<std::size_t> contour{ridges.index(x, y)};
    ridges(x, y) = 0;
    for (std::size_t next = 0; next < contour.size(); ++next) {
        const int cx = static_cast<int>(contour[next] % ridges.width),
                  cy = static_cast<int>(contour[next] / ridges.width);
        for (int ny = std::max(cy - 1, 0); ny <= std::min(cy + 1, ridges.height - 1); ++ny) {
            for (int nx = std::max(cx - 1, 0); nx <= std::min(cx + 1, ridges.width - 1); ++nx) {
                if (!(ridges(nx, ny) > 0) || ridges(nx, ny) < low) continue;
                contour.push_back(ridges.index(nx, ny));
                ridges(nx, ny) = 0;
            }
        }
    }
    return contour;
}

}  // namespace

bool same_contour(std::uint8_t sector, std::uint8_t other) {
    if (sector == 0 || other == 0) return false;
    const int difference = std::abs(sector - other);
    return std::min(difference, 8 - difference) <= 1;
}

RidgeMap find_ridges(const Image& image, const Image& weights, double sigma_px, int factor) {
    const int radius = std::clamp(static_cast<int>(std::ceil(3 * sigma_px)), 1, 64);
    auto [gx, gy] = gradient_images(image, gradient_taps({.sigma_px = sigma_px, .radius_px = radius}));
    const Image gain = local_gain(gx, gy);
    const Image usable = erode_weights(weights, radius / 2);
    for (std::size_t i = 0; i < gain.pixels.size(); ++i) {
        const float scale = usable.empty() || usable.pixels[i] > 0 ? gain.pixels[i] : 0;
        gx.pixels[i] *= scale;
        gy.pixels[i] *= scale;
    }
    gx = enlarged(gx, factor);
    gy = enlarged(gy, factor);
    Image magnitude(gx.width, gx.height);
    RidgeMap ridges{Image(gx.width, gx.height), std::vector<std::uint8_t>(gx.pixels.size(), 0)};
    for (std::size_t i = 0; i < magnitude.pixels.size(); ++i) {
        magnitude.pixels[i] = std::hypot(gx.pixels[i], gy.pixels[i]);
        ridges.sectors[i] = sector_of(gx.pixels[i], gy.pixels[i]);
    }
    for (int y = 1; y < magnitude.height - 1; ++y) {
        for (int x = 1; x < magnitude.width - 1; ++x) {
            const float here = magnitude(x, y);
            if (!(here > 0)) continue;
            const double dx = gx(x, y) / here, dy = gy(x, y) / here;
            const float ahead = bilinear(magnitude, x + dx, y + dy), behind = bilinear(magnitude, x - dx, y - dy);
            if (here >= ahead && here > behind) ridges.strength(x, y) = here;
        }
    }
    return ridges;
}

EdgeMap find_edges(RidgeMap ridges, double kept_share, int shortest_px) {
    const int width = ridges.strength.width, height = ridges.strength.height;
    EdgeMap edges{width, height, std::vector<std::uint8_t>(ridges.sectors.size(), 0)};
    const float high = seed_threshold(ridges.strength, kept_share);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            if (!(ridges.strength(x, y) > 0) || ridges.strength(x, y) < high) continue;
            const std::vector<std::size_t> contour = take_contour(ridges.strength, x, y, high / 2);
            if (static_cast<int>(contour.size()) < shortest_px) continue;
            for (const std::size_t i : contour) edges.sectors[i] = ridges.sectors[i];
        }
    }
    return edges;
}

EdgeMap thickened(const EdgeMap& edges, int radius_px) {
    EdgeMap thick = edges;
    for (int y = 0; y < edges.height; ++y) {
        for (int x = 0; x < edges.width; ++x) {
            if (edges(x, y) == 0) continue;
            for (int dy = -radius_px; dy <= radius_px; ++dy) {
                for (int dx = -radius_px; dx <= radius_px; ++dx) {
                    const int nx = x + dx, ny = y + dy;
                    if (dx * dx + dy * dy > radius_px * radius_px || nx < 0 || ny < 0) continue;
                    if (nx >= edges.width || ny >= edges.height) continue;
                    thick.sectors[static_cast<std::size_t>(ny) * edges.width + nx] = edges(x, y);
                }
            }
        }
    }
    return thick;
}

}  // namespace raylign::detail::apps

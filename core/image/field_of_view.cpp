#include "core/image/field_of_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace raylign {
namespace {

constexpr int kRays = 180;
constexpr double kLeastRays = 0.2 * kRays;  // must meet a dark border: a round field may show in the corners only
constexpr double kAgreeingShare = 0.75;     // of these rays; a body that crosses the field's edge hides the rest
constexpr double kCircleTolerance = 0.03;   // of the radius: blooming blurs the edge by 1 % on real image intensifiers
constexpr double kSideTolerance = 0.015;    // of the image's side
constexpr double kLeastRadiusShare = 0.45;  // of the shorter side: smaller circles are balls and heads
constexpr double kLeastSideShare = 0.5;     // of the image's side

struct Point {
    double x = 0, y = 0;  // from the image's middle [px]
};

bool is_dark(const Image& image, const Image& weights, float dark_below, int x, int y) {
    if (!weights.empty() && !(weights(x, y) > 0)) return true;
    return !(image(x, y) > dark_below);  // NaN is dark
}

/// Where the dark border ends, for the rays that begin in it.
std::vector<Point> border_ends(const Image& image, const Image& weights, float dark_below) {
    const double cx = (image.width - 1) / 2.0, cy = (image.height - 1) / 2.0;
    std::vector<Point> ends;
    for (int i = 0; i < kRays; ++i) {
        const double angle = 2 * std::numbers::pi * i / kRays;
        const double ux = std::cos(angle), uy = std::sin(angle);
        const double reach = std::min(cx / std::max(std::abs(ux), 1e-9), cy / std::max(std::abs(uy), 1e-9));
        double r = reach;
        for (; r > 0; --r) {
            const int x = static_cast<int>(std::lround(cx + r * ux)), y = static_cast<int>(std::lround(cy + r * uy));
            if (!is_dark(image, weights, dark_below, x, y)) break;
        }
        if (r < reach && r > 0) ends.push_back({r * ux, r * uy});
    }
    return ends;
}

template <typename Agrees>
bool most_agree(const std::vector<Point>& ends, Agrees agrees) {
    return static_cast<double>(std::ranges::count_if(ends, agrees)) >=
           kAgreeingShare * static_cast<double>(ends.size());
}

bool is_circle(const std::vector<Point>& ends, const Image& image) {
    std::vector<double> radii;
    for (const Point& end : ends) radii.push_back(std::hypot(end.x, end.y));
    std::ranges::sort(radii);
    const double radius = radii[radii.size() / 2];
    if (radius < kLeastRadiusShare * std::min(image.width, image.height)) return false;
    const double tolerance = std::max(1.0, kCircleTolerance * radius);
    return most_agree(ends, [&](const Point& end) { return std::abs(std::hypot(end.x, end.y) - radius) <= tolerance; });
}

bool is_rectangle(const std::vector<Point>& ends, const Image& image) {
    const auto side = [&](double Point::*coordinate, double share) {
        std::vector<double> values;
        for (const Point& end : ends) values.push_back(end.*coordinate);
        std::ranges::sort(values);
        return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
    };
    constexpr double kOutliers = 0.02;  // rays through a bright label
    const double left = side(&Point::x, kOutliers), right = side(&Point::x, 1 - kOutliers);
    const double top = side(&Point::y, kOutliers), bottom = side(&Point::y, 1 - kOutliers);
    if (right - left < kLeastSideShare * image.width || bottom - top < kLeastSideShare * image.height) return false;
    const double dx = std::max(1.0, kSideTolerance * image.width), dy = std::max(1.0, kSideTolerance * image.height);
    return most_agree(ends, [&](const Point& end) {
        return std::min(std::abs(end.x - left), std::abs(end.x - right)) <= dx ||
               std::min(std::abs(end.y - top), std::abs(end.y - bottom)) <= dy;
    });
}

}  // namespace

bool dark_border_frames_field(const Image& image, const Image& weights, float dark_below) {
    const std::vector<Point> ends = border_ends(image, weights, dark_below);
    if (static_cast<double>(ends.size()) < kLeastRays) return false;
    return is_circle(ends, image) || is_rectangle(ends, image);
}

}  // namespace raylign

#include "core/image/field_of_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

namespace raylign::detail {
namespace {

constexpr int kRays = 180;
constexpr double kLeastRays = 0.2 * kRays;  // must meet a dark border: a round field may show in the corners only
constexpr double kAgreeingShare = 0.75;     // of these rays; a body that crosses the field's edge hides the rest
constexpr double kCircleTolerance = 0.03;   // of the radius: blooming blurs the edge by 1 % on real image intensifiers
constexpr double kSideTolerance = 0.015;    // of the image's side
constexpr double kLeastRadiusShare = 0.45;  // of the shorter side: smaller circles are balls and heads
constexpr double kLeastSideShare = 0.5;     // of the image's side
constexpr double kLeastSideRays = 0.05 * kRays;  // a side of a narrow field takes up few rays
constexpr int kRingPx = 2;                       // within the field's edge, which is blurred

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

/// Where a pixel lies: clearly outside the field, or near its edge, where a dark pixel is outside.
enum class Place { inside, edge, outside };
using Field = std::function<Place(const Point&)>;

Field circle_of(const std::vector<Point>& ends, const Image& image) {
    std::vector<double> radii;
    for (const Point& end : ends) radii.push_back(std::hypot(end.x, end.y));
    std::ranges::sort(radii);
    const double radius = radii[radii.size() / 2];
    if (radius < kLeastRadiusShare * std::min(image.width, image.height)) return {};
    const double tolerance = std::max(1.0, kCircleTolerance * radius);
    const Field field = [=](const Point& point) {
        const double beyond = std::sqrt(point.x * point.x + point.y * point.y) - radius;
        return beyond > tolerance ? Place::outside : beyond < -tolerance ? Place::inside : Place::edge;
    };
    return most_agree(ends, [&](const Point& end) { return field(end) == Place::edge; }) ? field : Field();
}

/// One side of a rectangle; `sign` -1 is the left or upper one.
struct Side {
    double Point::*coordinate;
    double sign, position, tolerance;
    bool is_seen = true;  // enough rays end there; else the field may reach the image's border
    [[nodiscard]] double beyond(const Point& point) const { return sign * (point.*coordinate - position); }
};

Side side_of(const std::vector<Point>& ends, double Point::*coordinate, double sign, double image_side) {
    constexpr double kOutliers = 0.02;  // rays through a bright label
    std::vector<double> values;
    for (const Point& end : ends) values.push_back(end.*coordinate);
    std::ranges::sort(values);
    const double share = sign < 0 ? kOutliers : 1 - kOutliers;
    const double position = values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
    Side side{coordinate, sign, position, std::max(1.0, kSideTolerance * image_side)};
    const auto near = [&](const Point& end) { return std::abs(side.beyond(end)) <= side.tolerance; };
    side.is_seen = static_cast<double>(std::ranges::count_if(ends, near)) >= kLeastSideRays;
    return side;
}

Field rectangle_of(const std::vector<Point>& ends, const Image& image) {
    const std::array<Side, 4> sides = {
        side_of(ends, &Point::x, -1, image.width), side_of(ends, &Point::x, 1, image.width),
        side_of(ends, &Point::y, -1, image.height), side_of(ends, &Point::y, 1, image.height)};
    if (sides[1].position - sides[0].position < kLeastSideShare * image.width) return {};
    if (sides[3].position - sides[2].position < kLeastSideShare * image.height) return {};
    const auto is_near = [&](const Point& end) {
        return std::ranges::any_of(sides,
                                   [&](const Side& side) { return std::abs(side.beyond(end)) <= side.tolerance; });
    };
    if (!most_agree(ends, is_near)) return {};
    return [sides](const Point& point) {
        Place place = Place::inside;
        for (const Side& side : sides) {
            if (!side.is_seen || side.beyond(point) < -side.tolerance) continue;
            if (side.beyond(point) > side.tolerance) return Place::outside;
            place = Place::edge;
        }
        return place;
    };
}

/// Sets 0 all pixels within kRingPx of (x, y).
void clear_around(Image& weights, int x, int y) {
    for (int v = std::max(0, y - kRingPx); v <= std::min(weights.height - 1, y + kRingPx); ++v) {
        for (int u = std::max(0, x - kRingPx); u <= std::min(weights.width - 1, x + kRingPx); ++u) weights(u, v) = 0;
    }
}

}  // namespace

Image field_of_view_weights(const Image& image, const Image& weights, float dark_below) {
    const std::vector<Point> ends = border_ends(image, weights, dark_below);
    if (static_cast<double>(ends.size()) < kLeastRays) return {};
    Field field = circle_of(ends, image);
    if (!field) field = rectangle_of(ends, image);
    if (!field) return {};
    Image inside(image.width, image.height, 1);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const Place place = field({x - (image.width - 1) / 2.0, y - (image.height - 1) / 2.0});
            const bool is_edge = place == Place::edge && is_dark(image, weights, dark_below, x, y);
            if (place == Place::outside || is_edge) clear_around(inside, x, y);
        }
    }
    return inside;
}

}  // namespace raylign::detail

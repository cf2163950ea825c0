#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

namespace raylign::detail {

struct HullPoint {
    double x = 0, y = 0;
};

/// The convex hull, in one turning direction, without points on its edges. Andrew's monotone chain [Andrew79].
[[nodiscard]] std::vector<HullPoint> convex_hull(std::vector<HullPoint> points);

/// `count` points at even steps along the hull.
[[nodiscard]] std::vector<HullPoint> along_hull(const std::vector<HullPoint>& hull, int count);

/// The fewest corners whose polygon keeps within `tolerance` of the hull: [Douglas73].
[[nodiscard]] std::vector<HullPoint> simplified(const std::vector<HullPoint>& hull, double tolerance);

struct Circle {
    double x = 0, y = 0, radius = 0;
};

/// The circle through the points by least squares [Kasa76], fitted again to the nearer 3/4 of them; empty unless
/// 85 % of all lie within 1.5 % of the radius (or 1) of it and they take up at least an eighth of its round.
[[nodiscard]] std::optional<Circle> fit_circle(const std::vector<HullPoint>& points);

/// Distance from the nearest edge, positive inside. Edges whose middle `is_open` count as far away for points inside.
template <typename IsOpen>
[[nodiscard]] double depth_in_hull(const std::vector<HullPoint>& hull, const HullPoint& point, IsOpen is_open) {
    double depth = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < hull.size(); ++i) {
        const HullPoint &a = hull[i], &b = hull[(i + 1) % hull.size()];
        const double length = std::hypot(b.x - a.x, b.y - a.y);
        if (!(length > 0) || is_open(HullPoint{(a.x + b.x) / 2, (a.y + b.y) / 2})) continue;
        const double across = ((b.x - a.x) * (point.y - a.y) - (b.y - a.y) * (point.x - a.x)) / length;
        depth = std::min(depth, across);
    }
    return depth;
}

}  // namespace raylign::detail

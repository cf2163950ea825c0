#include "core/image/convex_hull.h"

#include <numbers>
#include <set>

#include "core/base/linear_algebra.h"

namespace raylign::detail {
namespace {

double cross(const HullPoint& o, const HullPoint& a, const HullPoint& b) {
    return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
}

double distance(const HullPoint& a, const HullPoint& b) { return std::hypot(a.x - b.x, a.y - b.y); }

/// Keeps, between corners `first` and `last`, the farthest one from their line while it is beyond the tolerance.
void keep_corners(const std::vector<HullPoint>& hull, std::size_t first, std::size_t last, double tolerance,
                  std::vector<bool>& kept) {
    const HullPoint &a = hull[first], &b = hull[last % hull.size()];
    const double length = std::max(distance(a, b), 1e-12);
    std::size_t farthest = first;
    double most = tolerance;
    for (std::size_t i = first + 1; i < last; ++i) {
        const double off = std::abs(cross(a, b, hull[i])) / length;
        if (off > most) {
            most = off;
            farthest = i;
        }
    }
    if (farthest == first) return;
    kept[farthest] = true;
    keep_corners(hull, first, farthest, tolerance, kept);
    keep_corners(hull, farthest, last, tolerance, kept);
}

/// x^2 + y^2 + a x + b y + c = 0 in least squares.
Circle kasa(const std::vector<HullPoint>& points) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const HullPoint& p : points) {
        const Eigen::Vector3d row(p.x, p.y, 1);
        normal += row * row.transpose();
        right -= row * (p.x * p.x + p.y * p.y);
    }
    const Eigen::Vector3d s = solve_symmetric(normal, right);
    return {-s[0] / 2, -s[1] / 2, std::sqrt(std::max(0.0, (s[0] * s[0] + s[1] * s[1]) / 4 - s[2]))};
}

double off_circle(const Circle& circle, const HullPoint& p) {
    return std::abs(std::hypot(p.x - circle.x, p.y - circle.y) - circle.radius);
}

}  // namespace

std::vector<HullPoint> convex_hull(std::vector<HullPoint> points) {
    const auto before = [](const HullPoint& a, const HullPoint& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); };
    std::ranges::sort(points, before);
    std::vector<HullPoint> hull;
    for (int pass = 0; pass < 2; ++pass) {
        const std::size_t begin = hull.size();
        for (const HullPoint& p : points) {
            while (hull.size() >= begin + 2 && cross(hull[hull.size() - 2], hull.back(), p) <= 0) hull.pop_back();
            hull.push_back(p);
        }
        if (!hull.empty()) hull.pop_back();  // the other pass begins with it
        std::ranges::reverse(points);
    }
    return hull;
}

std::vector<HullPoint> along_hull(const std::vector<HullPoint>& hull, int count) {
    double round = 0;
    for (std::size_t i = 0; i < hull.size(); ++i) round += distance(hull[i], hull[(i + 1) % hull.size()]);
    std::vector<HullPoint> points;
    const double step = round / count;
    double next = 0, passed = 0;
    for (std::size_t i = 0; i < hull.size(); ++i) {
        const HullPoint &a = hull[i], &b = hull[(i + 1) % hull.size()];
        const double length = distance(a, b);
        for (; next < passed + length && static_cast<int>(points.size()) < count; next += step) {
            const double t = (next - passed) / length;
            points.push_back({a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)});
        }
        passed += length;
    }
    return points;
}

std::vector<HullPoint> simplified(const std::vector<HullPoint>& hull, double tolerance) {
    if (hull.size() < 4) return hull;
    // Two corners that stay: the first, and the one farthest from it.
    const auto far = std::ranges::max_element(hull, {}, [&](const HullPoint& p) { return distance(p, hull[0]); });
    const auto opposite = static_cast<std::size_t>(far - hull.begin());
    std::vector<bool> kept(hull.size());
    kept[0] = kept[opposite] = true;
    keep_corners(hull, 0, opposite, tolerance, kept);
    keep_corners(hull, opposite, hull.size(), tolerance, kept);
    std::vector<HullPoint> corners;
    for (std::size_t i = 0; i < hull.size(); ++i) {
        if (kept[i]) corners.push_back(hull[i]);
    }
    return corners;
}

std::optional<Circle> fit_circle(const std::vector<HullPoint>& points) {
    if (points.size() < 8) return std::nullopt;
    Circle circle = kasa(points);
    for (int pass = 0; pass < 3; ++pass) {
        std::vector<HullPoint> nearer = points;
        std::ranges::sort(nearer, {}, [&](const HullPoint& p) { return off_circle(circle, p); });
        nearer.resize(nearer.size() * 3 / 4);
        circle = kasa(nearer);
    }
    if (!(circle.radius > 0) || !std::isfinite(circle.radius)) return std::nullopt;
    const double tolerance = std::max(1.0, 0.015 * circle.radius);
    const auto near =
        std::ranges::count_if(points, [&](const HullPoint& p) { return off_circle(circle, p) <= tolerance; });
    std::set<int> sectors;  // of 48
    for (const HullPoint& p : points) {
        const double angle = std::atan2(p.y - circle.y, p.x - circle.x) / (2 * std::numbers::pi) + 0.5;
        sectors.insert(static_cast<int>(48 * angle));
    }
    const bool is_circle =
        static_cast<double>(near) >= 0.85 * static_cast<double>(points.size()) && sectors.size() >= 6;
    return is_circle ? std::optional(circle) : std::nullopt;
}

}  // namespace raylign::detail

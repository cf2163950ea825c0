#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/random.h"
#include "core/image/convex_hull.h"

namespace raylign::detail {
namespace {

double twice_area(const HullPoint& a, const HullPoint& b, const HullPoint& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// From the line through a and b.
double off_line(const HullPoint& a, const HullPoint& b, const HullPoint& p) {
    return std::abs(twice_area(a, b, p)) / std::hypot(b.x - a.x, b.y - a.y);
}

bool has_corner(const std::vector<HullPoint>& hull, double x, double y) {
    return std::ranges::any_of(hull, [&](const HullPoint& p) { return p.x == x && p.y == y; });
}

std::vector<HullPoint> circle_points(int count, double radius, double from_turn = 0, double to_turn = 1) {
    std::vector<HullPoint> points;
    for (int i = 0; i < count; ++i) {
        const double angle = 2 * std::numbers::pi * (from_turn + (to_turn - from_turn) * i / count);
        points.push_back({30 + radius * std::cos(angle), -20 + radius * std::sin(angle)});
    }
    return points;
}

const std::vector<HullPoint> kRectangle = {{0, 0}, {8, 0}, {8, 4}, {0, 4}};

TEST(ConvexHull, KeepsTheCornersAndDropsTheRest) {
    std::vector<HullPoint> points;
    for (int y = 0; y <= 4; ++y) {
        for (int x = 0; x <= 8; ++x) points.push_back({static_cast<double>(x), static_cast<double>(y)});
    }
    const std::vector<HullPoint> hull = convex_hull(points);
    ASSERT_EQ(hull.size(), 4u) << "no points on the edges";
    for (const HullPoint& corner : kRectangle) EXPECT_TRUE(has_corner(hull, corner.x, corner.y));
}

TEST(ConvexHull, TurnsOneWayAndHoldsAllPoints) {
    Random random(3);
    std::vector<HullPoint> points;
    for (int i = 0; i < 300; ++i) points.push_back({random.normal(), random.normal()});
    const std::vector<HullPoint> hull = convex_hull(points);
    ASSERT_GE(hull.size(), 3u);
    for (std::size_t i = 0; i < hull.size(); ++i) {
        const HullPoint &a = hull[i], &b = hull[(i + 1) % hull.size()];
        EXPECT_GT(twice_area(a, b, hull[(i + 2) % hull.size()]), 0);
        for (const HullPoint& p : points) ASSERT_GE(twice_area(a, b, p), -1e-12);
    }
}

TEST(ConvexHull, OfItsOwnCornersIsItself) {
    const std::vector<HullPoint> once = convex_hull(circle_points(17, 5)), twice = convex_hull(once);
    ASSERT_EQ(once.size(), 17u);
    ASSERT_EQ(twice.size(), 17u);
    for (const HullPoint& p : once) EXPECT_TRUE(has_corner(twice, p.x, p.y));
}

TEST(ConvexHull, RepeatedPointsCountOnce) {
    std::vector<HullPoint> points = kRectangle;
    points.insert(points.end(), kRectangle.begin(), kRectangle.end());
    EXPECT_EQ(convex_hull(points).size(), 4u);
}

TEST(ConvexHull, OfPointsOnALineIsItsEnds) {
    const std::vector<HullPoint> hull = convex_hull({{1, 1}, {3, 3}, {2, 2}, {5, 5}});
    ASSERT_EQ(hull.size(), 2u);
    EXPECT_TRUE(has_corner(hull, 1, 1));
    EXPECT_TRUE(has_corner(hull, 5, 5));
}

TEST(ConvexHull, OfNothingIsNothing) { EXPECT_TRUE(convex_hull({}).empty()); }

TEST(AlongHull, PointsLieOnTheEdgesAtEvenSteps) {
    // 24 round; steps of 2 along sides of 8 and 4 meet every corner.
    const std::vector<HullPoint> points = along_hull(kRectangle, 12);
    ASSERT_EQ(points.size(), 12u);
    for (std::size_t i = 0; i < 12; ++i) {
        const HullPoint &p = points[i], &next = points[(i + 1) % 12];
        EXPECT_NEAR(std::hypot(next.x - p.x, next.y - p.y), 2, 1e-12) << i;
        const double to_edge = std::min({std::abs(p.x), std::abs(p.x - 8), std::abs(p.y), std::abs(p.y - 4)});
        EXPECT_NEAR(to_edge, 0, 1e-12) << i;
    }
}

TEST(AlongHull, GivesAsManyPointsAsAskedFor) {
    for (int count = 1; count < 100; ++count) {
        EXPECT_EQ(along_hull(circle_points(11, 7), count).size(), static_cast<std::size_t>(count)) << count;
    }
}

TEST(Simplified, WithoutToleranceKeepsAPolygonsCorners) {
    EXPECT_EQ(simplified(convex_hull(circle_points(40, 5)), 0).size(), 40u);
}

TEST(Simplified, KeepsWithinTheToleranceOfTheHull) {
    const std::vector<HullPoint> hull = convex_hull(circle_points(360, 50));
    for (const double tolerance : {0.05, 0.5, 3.}) {
        const std::vector<HullPoint> few = simplified(hull, tolerance);
        double most = 0;
        for (const HullPoint& p : hull) {
            double nearest = 1e9;
            for (std::size_t i = 0; i < few.size(); ++i) {
                nearest = std::min(nearest, off_line(few[i], few[(i + 1) % few.size()], p));
            }
            most = std::max(most, nearest);
        }
        EXPECT_LE(most, tolerance) << tolerance;
        EXPECT_LT(few.size(), hull.size() / 2) << tolerance;
        EXPECT_GE(few.size(), 3u) << tolerance;
    }
}

TEST(Simplified, FewerCornersWhereMoreIsTolerated) {
    const std::vector<HullPoint> hull = convex_hull(circle_points(360, 50));
    EXPECT_LT(simplified(hull, 2).size(), simplified(hull, 0.2).size());
}

TEST(Simplified, DropsABumpBelowTheToleranceAndKeepsOneAbove) {
    const std::vector<HullPoint> bumpy = {{0, 0}, {10, -0.4}, {20, 0}, {20, 10}, {0, 10}};
    EXPECT_FALSE(has_corner(simplified(bumpy, 0.5), 10, -0.4));
    EXPECT_TRUE(has_corner(simplified(bumpy, 0.3), 10, -0.4));
}

TEST(FitCircle, IsExactForPointsOnACircle) {
    for (const double share : {1., 0.5, 0.2}) {  // of its round
        const auto circle = fit_circle(circle_points(60, 12, 0.1, 0.1 + share));
        ASSERT_TRUE(circle) << share;
        EXPECT_NEAR(circle->x, 30, 1e-6) << share;
        EXPECT_NEAR(circle->y, -20, 1e-6) << share;
        EXPECT_NEAR(circle->radius, 12, 1e-6) << share;
    }
}

TEST(FitCircle, ATenthOfThePointsElsewhereDoesNotMatter) {
    std::vector<HullPoint> points = circle_points(90, 100);
    for (int i = 0; i < 10; ++i) points.push_back({30. + i, -20});
    const auto circle = fit_circle(points);
    ASSERT_TRUE(circle);
    EXPECT_NEAR(circle->radius, 100, 1e-6);
}

TEST(FitCircle, RefusesWhereAFifthOfThePointsLiesElsewhere) {
    std::vector<HullPoint> points = circle_points(80, 100);
    for (int i = 0; i < 20; ++i) points.push_back({30. + i, -20});
    EXPECT_FALSE(fit_circle(points));
}

TEST(FitCircle, RefusesAShortArc) { EXPECT_FALSE(fit_circle(circle_points(60, 100, 0.1, 0.15))); }

TEST(FitCircle, RefusesASquare) { EXPECT_FALSE(fit_circle(along_hull({{0, 0}, {100, 0}, {100, 100}, {0, 100}}, 80))); }

TEST(FitCircle, RefusesPointsOnALine) {
    std::vector<HullPoint> points;
    for (int i = 0; i < 40; ++i) points.push_back({2. * i, 3. * i});
    EXPECT_FALSE(fit_circle(points));
}

TEST(FitCircle, NeedsEightPoints) {
    EXPECT_FALSE(fit_circle(circle_points(7, 10)));
    EXPECT_TRUE(fit_circle(circle_points(8, 10)));
}

TEST(DepthInHull, IsTheDistanceFromTheNearestEdgePositiveInside) {
    const auto none_open = [](const HullPoint&) { return false; };
    EXPECT_DOUBLE_EQ(depth_in_hull(kRectangle, {3, 1.5}, none_open), 1.5);
    EXPECT_DOUBLE_EQ(depth_in_hull(kRectangle, {8.5, 2}, none_open), -0.5);
    EXPECT_DOUBLE_EQ(depth_in_hull(kRectangle, {8, 2}, none_open), 0);
}

TEST(DepthInHull, OpenEdgesDoNotCount) {
    const auto bottom_is_open = [](const HullPoint& middle) { return middle.y == 0; };
    EXPECT_DOUBLE_EQ(depth_in_hull(kRectangle, {3, 0.5}, bottom_is_open), 3);
}

}  // namespace
}  // namespace raylign::detail

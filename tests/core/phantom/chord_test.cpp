#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/base/error.h"
#include "core/base/random.h"
#include "raylign/phantom.h"

namespace raylign::detail {
namespace {

// Rounding of coordinates near 1000 mm (2e-13) through a few operations.
constexpr double kExact_mm = 1e-11;

RigidTransform random_pose(Random& random, double reach_mm) {
    Twist twist;
    twist << random.uniform(0, 3) * random.direction(), reach_mm * random.direction();
    return exp(twist);
}

/// Membership written down anew, from the definitions: the oracle of the chords.
bool contains(const Box& b, const Eigen::Vector3d& p) { return (p.array().abs() < b.half_size_mm.array()).all(); }
bool contains(const Ellipsoid& e, const Eigen::Vector3d& p) { return p.cwiseQuotient(e.radii_mm).norm() < 1; }
bool contains(const EllipticCylinder& c, const Eigen::Vector3d& p) {
    return std::hypot(p.x() / c.radii_mm.x(), p.y() / c.radii_mm.y()) < 1 && std::abs(p.z()) < c.half_length_mm;
}
bool contains_ct(const Solid& solid, const Eigen::Vector3d& x_ct) {
    return std::visit([&](const auto& s) { return contains(s, inverse(s.ct_from_solid) * x_ct); }, solid);
}

Solid random_solid(Random& random, int kind) {
    const RigidTransform pose = random_pose(random, 20);
    const Eigen::Vector3d size(random.uniform(5, 30), random.uniform(5, 30), random.uniform(5, 30));
    if (kind == 0) return Box{pose, size, 1};
    if (kind == 1) return Ellipsoid{pose, size, 1};
    return EllipticCylinder{pose, size.head<2>(), size.z(), 1};
}

void expect_chords_match_midpoint_sums(int kind) {
    Random random(17 + kind);
    constexpr double kStep_mm = 0.01, kReach_mm = 130;  // solids lie within 20 + 30 sqrt(3) mm of the origin
    int hits = 0;
    for (int trial = 0; trial < 60; ++trial) {
        const Solid solid = random_solid(random, kind);
        const Eigen::Vector3d start_ct = random.uniform(0, 60) * random.direction();  // at times inside
        const Eigen::Vector3d aim_ct = random.uniform(0, 30) * random.direction();
        const Eigen::Vector3d direction_ct = (aim_ct - start_ct).normalized();
        double sum_mm = 0;
        for (double t = kStep_mm / 2; t < kReach_mm; t += kStep_mm) {
            if (contains_ct(solid, start_ct + t * direction_ct)) sum_mm += kStep_mm;
        }
        hits += sum_mm > 0;
        // Each of the chord's two ends is off by up to half a step.
        EXPECT_NEAR(chord_mm(solid, start_ct, direction_ct), sum_mm, 1.001 * kStep_mm) << "trial " << trial;
    }
    EXPECT_GT(hits, 20);  // else the test shows nothing
}

TEST(Chord, OfBoxEqualsMidpointSum) { expect_chords_match_midpoint_sums(0); }
TEST(Chord, OfEllipsoidEqualsMidpointSum) { expect_chords_match_midpoint_sums(1); }
TEST(Chord, OfCylinderEqualsMidpointSum) { expect_chords_match_midpoint_sums(2); }

TEST(Chord, BoxAlongItsAxesIsItsSide) {
    const Solid box = Box{RigidTransform::translate({1, 2, 3}), {4, 5, 6}, 1};
    for (int axis = 0; axis < 3; ++axis) {
        for (const double sign : {-1.0, 1.0}) {
            const Eigen::Vector3d direction = sign * Eigen::Vector3d::Unit(axis);
            const Eigen::Vector3d start = Eigen::Vector3d(1.5, 2.5, 2.5) - 1000 * direction;
            EXPECT_NEAR(chord_mm(box, start, direction), 8 + 2 * axis, kExact_mm);
            // Parallel and outside in one other axis.
            const Eigen::Vector3d beside = start + 7 * Eigen::Vector3d::Unit((axis + 1) % 3);
            EXPECT_EQ(chord_mm(box, beside, direction), 0);
        }
    }
}

TEST(Chord, LineWithinAFaceHasNone) {
    const Solid box = Box{{}, {4, 5, 6}, 1};
    EXPECT_EQ(chord_mm(box, {4, 0, -100}, {0, 0, 1}), 0);
    EXPECT_EQ(chord_mm(box, {4, 5, -100}, {0, 0, 1}), 0);
    EXPECT_NEAR(chord_mm(box, {std::nextafter(4.0, 0.0), 0, -100}, {0, 0, 1}), 12, kExact_mm);
}

TEST(Chord, BoxDiagonalPassesEdgesAndCorners) {
    const Solid box = Box{{}, {4, 4, 4}, 1};
    EXPECT_NEAR(chord_mm(box, {-100, -100, -100}, Eigen::Vector3d::Ones().normalized()), 8 * std::sqrt(3.0), kExact_mm);
    EXPECT_NEAR(chord_mm(box, {-100, -100, 0}, Eigen::Vector3d(1, 1, 0).normalized()), 8 * std::sqrt(2.0), kExact_mm);
}

TEST(Chord, CountsOnlyWhatLiesInFrontOfTheStart) {
    const Solid solids[] = {Box{{}, {4, 4, 4}, 1}, Ellipsoid{{}, {4, 4, 4}, 1}, EllipticCylinder{{}, {4, 4}, 4, 1}};
    for (const Solid& solid : solids) {
        for (int axis = 0; axis < 3; ++axis) {
            const Eigen::Vector3d direction = Eigen::Vector3d::Unit(axis);
            EXPECT_NEAR(chord_mm(solid, Eigen::Vector3d::Zero(), direction), 4, kExact_mm);
            EXPECT_NEAR(chord_mm(solid, -1 * direction, direction), 5, kExact_mm);
            EXPECT_EQ(chord_mm(solid, 4.5 * direction, direction), 0);
            EXPECT_EQ(chord_mm(solid, 1000 * direction, direction), 0);
        }
    }
}

TEST(Chord, OffCentreEllipsoidAtObliqueDirection) {
    // x^2/a^2 + ... = 1 along p + t d: 2 sqrt(B^2 - A C) / A, evaluated in long double near the centre.
    Twist twist;
    twist << 0.3, -0.5, 0.8, 11, -7, 5;
    const RigidTransform pose = exp(twist);
    const Eigen::Vector3d radii(10, 20, 30), near(1, -3, 4), direction = Eigen::Vector3d(0.48, -0.6, 0.64).normalized();
    long double a = 0, b = 0, c = -1;
    for (int i = 0; i < 3; ++i) {
        const long double r2 = static_cast<long double>(radii[i]) * radii[i];
        a += direction[i] * direction[i] / r2;
        b += near[i] * direction[i] / r2;
        c += near[i] * near[i] / r2;
    }
    const auto expected = static_cast<double>(2 * std::sqrt(b * b - a * c) / a);
    for (const double distance_mm : {200.0, 1500.0, 1e5}) {  // from far as exactly as from near
        const Eigen::Vector3d start_ct = pose * (near - distance_mm * direction);
        EXPECT_NEAR(chord_mm(Ellipsoid{pose, radii, 1}, start_ct, pose.rotation * direction), expected,
                    1e-14 * distance_mm + kExact_mm);
    }
}

TEST(Chord, CylinderAlongAxisIsItsLengthAndAcrossItsDiameter) {
    const Solid cylinder = EllipticCylinder{{}, {3, 5}, 7, 1};
    EXPECT_NEAR(chord_mm(cylinder, {2.9, 0, -100}, {0, 0, 1}), 14, kExact_mm);
    EXPECT_EQ(chord_mm(cylinder, {3.1, 0, -100}, {0, 0, 1}), 0);
    EXPECT_NEAR(chord_mm(cylinder, {-100, 0, 6.9}, {1, 0, 0}), 6, kExact_mm);
    EXPECT_NEAR(chord_mm(cylinder, {0, 100, 0}, {0, -1, 0}), 10, kExact_mm);
    EXPECT_EQ(chord_mm(cylinder, {-100, 0, 7.1}, {1, 0, 0}), 0);
}

TEST(Chord, CylinderAlmostAlongItsAxisStaysFinite) {
    const Solid cylinder = EllipticCylinder{{}, {3, 5}, 7, 1};
    for (const double tilt : {1e-8, 1e-17, 1e-30, 1e-160, 1e-300}) {
        EXPECT_NEAR(chord_mm(cylinder, {0.5, 0.5, -100}, Eigen::Vector3d(tilt, 0, 1)), 14, kExact_mm) << tilt;
    }
}

TEST(LineIntegral, AddsOverOverlappingSolids) {
    const Phantom phantom{"two", {Box{{}, {4, 4, 4}, 0.02}, Ellipsoid{{}, {2, 2, 2}, -0.01}}};
    EXPECT_NEAR(exact_line_integral(phantom, {0, 0, -50}, {0, 0, 1}), 8 * 0.02 - 4 * 0.01, 1e-14);
}

TEST(ExactDrr, PixelHoldsTheIntegralOfTheRayThroughItsCentre) {
    const CArm c_arm{.sad_mm = 700,
                     .sdd_mm = 1100,
                     .primary_angle_deg = 20,
                     .secondary_angle_deg = -15,
                     .pixel_pitch_mm = {3, 4},
                     .size_px = {20, 16},
                     .principal_point_px = Eigen::Vector2d(8.3, 9.1)};
    const ViewGeometry view = view_from_c_arm(c_arm);
    Random random(5);
    const RigidTransform world_from_ct = random_pose(random, 10);
    const Phantom phantom = ellipsoid_phantom({100, 100, 100});
    const Image drr = exact_drr(phantom, view, world_from_ct);
    // Through a point in ct that projects to the pixel's centre.
    const Eigen::Vector3d source_ct = inverse(world_from_ct) * source_world_mm(view);
    const Eigen::Vector3d x_world = source_world_mm(view) + 700 * ray_direction_world(view, {7, 10});
    ASSERT_LT((project(view, x_world) - Eigen::Vector2d(7, 10)).norm(), 1e-9);
    const Eigen::Vector3d direction_ct = (inverse(world_from_ct) * x_world - source_ct).normalized();
    const double expected = exact_line_integral(phantom, source_ct, direction_ct);
    EXPECT_GT(expected, 0.1);
    EXPECT_NEAR(drr(7, 10), expected, 1e-7 * expected + 1e-8);  // float pixel
}

TEST(Phantoms, RefuseABadExtent) {
    EXPECT_THROW((void)box_phantom({100, 0, 100}), Error);
    EXPECT_THROW((void)ellipsoid_phantom({100, -1, 100}), Error);
    EXPECT_THROW((void)spine_phantom({100, std::nan(""), 100}), Error);
}

}  // namespace
}  // namespace raylign::detail

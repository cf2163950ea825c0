#include "raylign/phantom.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "core/base/error.h"

namespace raylign {
using namespace detail;
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kWaterPerMm = 0.02;  // of the simple phantoms; a round number, for tests are easier to read

/// Distances along a line between which it is inside; empty where !(begin < end).
struct Interval {
    double begin, end;
};
constexpr Interval kNowhere{0, 0};

Interval intersect(const Interval& a, const Interval& b) {
    return {std::max(a.begin, b.begin), std::min(a.end, b.end)};
}

/// Where |p + t d| < half. A parallel line is inside everywhere or nowhere: 0 * infinity must not decide.
Interval slab(double p, double d, double half) {
    if (d == 0) return std::abs(p) < half ? Interval{-kInfinity, kInfinity} : kNowhere;
    const double a = (-half - p) / d, b = (half - p) / d;
    return {std::min(a, b), std::max(a, b)};
}

/// Where |p + t d| < 1. The centre is projected on the line first: b^2 - 4 a c would cancel for a far source.
template <class Vector>
Interval unit_ball(const Vector& p, const Vector& d) {
    const double d2 = d.squaredNorm();
    // Below, crossing the ball would take 1e20 radii: the line is parallel to the cylinder's axis for every purpose.
    if (d2 < 1e-40) return p.squaredNorm() < 1 ? Interval{-kInfinity, kInfinity} : kNowhere;
    const double middle = -p.dot(d) / d2;
    const double h2 = 1 - (p + middle * d).squaredNorm();
    if (!(h2 > 0)) return kNowhere;
    const double half = std::sqrt(h2 / d2);
    return {middle - half, middle + half};
}

// Point and direction in the solid's own axes.
Interval inside(const Box& box, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
    Interval all{-kInfinity, kInfinity};
    for (int i = 0; i < 3; ++i) all = intersect(all, slab(p[i], d[i], box.half_size_mm[i]));
    return all;
}

Interval inside(const Ellipsoid& e, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
    return unit_ball<Eigen::Vector3d>(p.cwiseQuotient(e.radii_mm), d.cwiseQuotient(e.radii_mm));
}

Interval inside(const EllipticCylinder& c, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
    return intersect(
        unit_ball<Eigen::Vector2d>(p.head<2>().cwiseQuotient(c.radii_mm), d.head<2>().cwiseQuotient(c.radii_mm)),
        slab(p.z(), d.z(), c.half_length_mm));
}

double volume_of(const Box& box) { return 8 * box.half_size_mm.prod(); }
double volume_of(const Ellipsoid& e) { return 4 * std::numbers::pi / 3 * e.radii_mm.prod(); }
double volume_of(const EllipticCylinder& c) { return 2 * std::numbers::pi * c.radii_mm.prod() * c.half_length_mm; }

double attenuation_of(const Solid& solid) {
    return std::visit([](const auto& s) { return s.attenuation_per_mm; }, solid);
}

/// Sides of the simple phantoms, in shares of the extent: different on each axis, or rotations by 90 degrees look
/// alike.
Eigen::Vector3d half_sides_mm(const Eigen::Vector3d& extent_mm) {
    if (!(extent_mm.allFinite() && extent_mm.minCoeff() > 0)) {
        throw bad_value("smallest side of the phantom's extent", std::to_string(extent_mm.minCoeff()) + " mm",
                        "positive and finite");
    }
    return extent_mm.cwiseProduct(Eigen::Vector3d(0.25, 0.225, 0.2));
}

}  // namespace

double chord_mm(const Solid& solid, const Eigen::Vector3d& point_ct, const Eigen::Vector3d& direction_ct) {
    const auto chord = [&](const auto& s) {
        const RigidTransform& ct_from_solid = s.ct_from_solid;
        const Eigen::Vector3d p = ct_from_solid.rotation.transpose() * (point_ct - ct_from_solid.translation_mm);
        const Eigen::Vector3d d = ct_from_solid.rotation.transpose() * direction_ct;
        const Interval ray = intersect(inside(s, p, d), {0, kInfinity});
        return ray.begin < ray.end ? ray.end - ray.begin : 0.0;
    };
    return std::visit(chord, solid);
}

double volume_mm3(const Solid& solid) {
    return std::visit([](const auto& s) { return volume_of(s); }, solid);
}

double exact_mass_mm2(const Phantom& phantom) {
    double sum = 0;
    for (const Solid& solid : phantom.solids) sum += attenuation_of(solid) * volume_mm3(solid);
    return sum;
}

double exact_line_integral(const Phantom& phantom, const Eigen::Vector3d& source_ct,
                           const Eigen::Vector3d& direction_ct) {
    double sum = 0;
    for (const Solid& solid : phantom.solids) {
        sum += attenuation_of(solid) * chord_mm(solid, source_ct, direction_ct);
    }
    return sum;
}

Image exact_drr(const Phantom& phantom, const ViewGeometry& view, const RigidTransform& world_from_ct) {
    const RigidTransform ct_from_world = inverse(world_from_ct);
    const Eigen::Vector3d source_ct = ct_from_world * source_world_mm(view);
    Image drr(view.camera.size_px.x(), view.camera.size_px.y());
    for (int v = 0; v < drr.height; ++v) {
        for (int u = 0; u < drr.width; ++u) {
            const Eigen::Vector3d direction_ct = ct_from_world.rotation * ray_direction_world(view, {u, v});
            drr(u, v) = static_cast<float>(exact_line_integral(phantom, source_ct, direction_ct));
        }
    }
    return drr;
}

VoxelGrid centred_grid(const Eigen::Vector3i& size, const Eigen::Vector3d& spacing_mm) {
    VoxelGrid grid;
    grid.size = size;
    grid.spacing_mm = spacing_mm;
    grid.origin_mm = -0.5 * spacing_mm.cwiseProduct((size - Eigen::Vector3i::Ones()).cast<double>());
    return grid;
}

Phantom box_phantom(const Eigen::Vector3d& extent_mm) {
    return {"box", {Box{{}, half_sides_mm(extent_mm), kWaterPerMm}}};
}

Phantom ellipsoid_phantom(const Eigen::Vector3d& extent_mm) {
    return {"ellipsoid", {Ellipsoid{{}, half_sides_mm(extent_mm), kWaterPerMm}}};
}

}  // namespace raylign

#include "bench/triangle_drr.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "bench/exact_lengths.h"

namespace raylign::detail::bench {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// a + b x + c y over pixels.
struct Plane {
    double a = 0, b = 0, c = 0;
    [[nodiscard]] double at(double x, double y) const { return a + b * x + c * y; }
};

/// One triangle on the detector.
struct Facet {
    std::array<Plane, 3> sides;    ///< positive inside
    std::array<bool, 3> is_own{};  ///< a ray on the side is this triangle's: the top-left rule
    Plane slant;                   ///< normal . ray, for rays of depth 1
    double offset = 0, sign = 0;   ///< depth met = offset / slant
    Vector3d normal, about;        ///< in world; (source - centre) x normal
    Eigen::Array2i low{0, 0}, high{0, 0};
};

struct Rays {
    Rays(const ViewGeometry& view, const Vector3d& centre_world) : size(view.camera.size_px) {
        const Eigen::Matrix3d world_from_camera = view.camera_from_world.rotation.transpose();
        world_from_pixel = world_from_camera * view.camera.intrinsics_px.inverse();
        from_centre = source_world_mm(view) - centre_world;
        for (int y = 0; y < size.y(); ++y) {
            for (int x = 0; x < size.x(); ++x) length.push_back((world_from_pixel * Vector3d(x, y, 1)).norm());
        }
    }
    Eigen::Vector2i size;
    Eigen::Matrix3d world_from_pixel;
    Vector3d from_centre;
    std::vector<double> length;  ///< of a ray of depth 1, per pixel
};

bool make_facet(const std::array<Vector3d, 3>& world, const std::array<Vector2d, 3>& pixel, const Vector3d& source,
                const Rays& rays, Facet& facet) {
    const double area = cross(pixel[1] - pixel[0], pixel[2] - pixel[0]);
    if (area == 0) return false;
    facet.sign = area > 0 ? 1 : -1;
    Eigen::Array2d low = pixel[0].array(), high = low;
    for (std::size_t i = 0; i < 3; ++i) {
        low = low.min(pixel[i].array());
        high = high.max(pixel[i].array());
        const Vector2d edge = facet.sign * (pixel[(i + 1) % 3] - pixel[i]);
        facet.sides[i] = {-cross(edge, pixel[i]), -edge.y(), edge.x()};
        facet.is_own[i] = edge.y() < 0 || (edge.y() == 0 && edge.x() > 0);
    }
    facet.low = low.ceil().max(0.0).cast<int>();
    facet.high = high.floor().min(rays.size.cast<double>().array() - 1).cast<int>();
    facet.normal = (world[1] - world[0]).cross(world[2] - world[0]);
    const Vector3d slant = rays.world_from_pixel.transpose() * facet.normal;
    facet.slant = {slant.z(), slant.x(), slant.y()};
    facet.offset = facet.normal.dot(world[0] - source);
    facet.about = rays.from_centre.cross(facet.normal);
    return true;
}

/// Calls met(pixel, depth, 1 / slant, facet) for each ray that the facet is met by.
template <class Met>
void for_each_ray(const Facet& facet, const Rays& rays, const Met& met) {
    for (int y = facet.low.y(); y <= facet.high.y(); ++y) {
        double first = facet.low.x(), last = facet.high.x();
        for (std::size_t i = 0; i < 3; ++i) {  // where the row enters and leaves, to a pixel
            const Plane& side = facet.sides[i];
            if (side.b > 0) first = std::max(first, std::floor(-side.at(0, y) / side.b));
            if (side.b < 0) last = std::min(last, std::ceil(-side.at(0, y) / side.b));
        }
        for (int x = static_cast<int>(first); x <= static_cast<int>(last); ++x) {
            bool is_inside = true;
            for (std::size_t i = 0; i < 3; ++i) {
                const double side = facet.sides[i].at(x, y);
                is_inside = is_inside && (side > 0 || (side == 0 && facet.is_own[i]));
            }
            if (!is_inside) continue;
            const double per_slant = 1 / facet.slant.at(x, y);
            met(static_cast<std::size_t>(y) * static_cast<std::size_t>(rays.size.x()) + static_cast<std::size_t>(x),
                facet.offset * per_slant, per_slant);
        }
    }
}

template <class Use>
void for_each_facet(const TriangleMesh& mesh, const ViewGeometry& view, const RigidTransform& world_from_ct,
                    const Rays& rays, const Use& use) {
    std::vector<Vector3d> world;
    std::vector<Vector2d> pixel;
    for (const Vector3d& v : mesh.vertices_mm) {
        world.push_back(world_from_ct * v);
        pixel.push_back((view.camera.intrinsics_px * (view.camera_from_world * world.back())).hnormalized());
    }
    const Vector3d source = source_world_mm(view);
    Facet facet;
    for (const TriangleMesh::Triangle& t : mesh.triangles) {
        const auto a = static_cast<std::size_t>(t[0]), b = static_cast<std::size_t>(t[1]),
                   c = static_cast<std::size_t>(t[2]);
        if (make_facet({world[a], world[b], world[c]}, {pixel[a], pixel[b], pixel[c]}, source, rays, facet)) use(facet);
    }
}

/// Sign that makes lengths positive: triangles that are left are seen from inside.
double outwards(std::span<const double> lengths) {
    double sum = 0;
    for (const double length : lengths) sum += length;
    return sum < 0 ? -1 : 1;
}

double shown(double arriving, double floor) { return -std::log(floor + (1 - floor) * arriving); }

}  // namespace

Image TriangleDrr::render(const View& view, const RigidTransform& world_from_ct) const {
    const ViewGeometry fine = finer(view.geometry, samples);
    const Rays rays(fine, Vector3d::Zero());
    std::vector<double> lengths(rays.length.size());
    for_each_facet(mesh, fine, world_from_ct, rays, [&](const Facet& facet) {
        for_each_ray(facet, rays, [&](std::size_t i, double depth, double) { lengths[i] += facet.sign * depth; });
    });
    const double sign = outwards(lengths), floor = std::exp(-view.ceiling);
    Image image(view.geometry.camera.size_px.x(), view.geometry.camera.size_px.y());
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            double arriving = 0;
            for (int k = 0; k < samples * samples; ++k) {
                const auto i =
                    static_cast<std::size_t>((y * samples + k / samples) * rays.size.x() + x * samples + k % samples);
                arriving += lengths[i] == 0 ? 1 : std::exp(-mu_per_mm * sign * lengths[i] * rays.length[i]);
            }
            image(x, y) = static_cast<float>(shown(arriving / (samples * samples), floor));
        }
    }
    return image;
}

DrrWithDerivatives TriangleDrr::by_planes(const View& view, const RigidTransform& world_from_ct,
                                          const Vector3d& centre_ct_mm) const {
    const ViewGeometry fine = finer(view.geometry, samples);
    const Rays rays(fine, world_from_ct * centre_ct_mm);
    std::vector<double> lengths(rays.length.size());
    std::vector<Eigen::Matrix<float, 6, 1>> changes(rays.length.size(), Eigen::Matrix<float, 6, 1>::Zero());
    for_each_facet(mesh, fine, world_from_ct, rays, [&](const Facet& facet) {
        for_each_ray(facet, rays, [&](std::size_t i, double depth, double per_slant) {
            lengths[i] += facet.sign * depth;
            const auto x = static_cast<double>(i % static_cast<std::size_t>(rays.size.x()));
            const auto y = static_cast<double>(i / static_cast<std::size_t>(rays.size.x()));
            const Vector3d ray = rays.world_from_pixel * Vector3d(x, y, 1);
            const double scale = facet.sign * per_slant;
            // The point that is met moves by w x (p - c) + v: the depth by its share along the normal.
            changes[i].head<3>() += (scale * (facet.about + depth * ray.cross(facet.normal))).cast<float>();
            changes[i].tail<3>() += (scale * facet.normal).cast<float>();
        });
    });
    const double sign = outwards(lengths), floor = std::exp(-view.ceiling);
    const Eigen::Vector2i size = view.geometry.camera.size_px;
    DrrWithDerivatives made{Image(size.x(), size.y()), {}};
    for (Image& image : made.derivatives) image = Image(size.x(), size.y());
    for (int y = 0; y < size.y(); ++y) {
        for (int x = 0; x < size.x(); ++x) {
            double arriving = 0;
            Eigen::Matrix<double, 6, 1> change = Eigen::Matrix<double, 6, 1>::Zero();
            for (int k = 0; k < samples * samples; ++k) {
                const auto i =
                    static_cast<std::size_t>((y * samples + k / samples) * rays.size.x() + x * samples + k % samples);
                if (lengths[i] == 0) {
                    arriving += 1;
                    continue;
                }
                const double share = std::exp(-mu_per_mm * sign * lengths[i] * rays.length[i]);
                arriving += share;
                change += share * mu_per_mm * sign * rays.length[i] * changes[i].cast<double>();
            }
            const double all = samples * samples, seen = floor + (1 - floor) * arriving / all;
            made.drr(x, y) = static_cast<float>(-std::log(seen));
            for (std::size_t p = 0; p < 6; ++p) {
                made.derivatives[p](x, y) =
                    static_cast<float>((1 - floor) * change[static_cast<Eigen::Index>(p)] / all / seen);
            }
        }
    }
    return made;
}

DrrWithDerivatives TriangleDrr::by_differences(const View& view, const RigidTransform& world_from_ct,
                                               const Vector3d& centre_ct_mm, double step_mm, double radius_mm) const {
    DrrWithDerivatives made{render(view, world_from_ct), {}};
    const Vector3d centre = world_from_ct * centre_ct_mm;
    for (int p = 0; p < 6; ++p) {
        const double step = p < 3 ? step_mm / radius_mm : step_mm;
        Twist twist = Twist::Zero();
        twist[p] = step;
        const Image plus = render(view, exp_about(twist, centre) * world_from_ct);
        const Image minus = render(view, exp_about(-twist, centre) * world_from_ct);
        Image& change = made.derivatives[static_cast<std::size_t>(p)];
        change = plus;
        for (std::size_t i = 0; i < change.pixels.size(); ++i) {
            change.pixels[i] = static_cast<float>((plus.pixels[i] - minus.pixels[i]) / (2 * step));
        }
    }
    return made;
}

}  // namespace raylign::detail::bench

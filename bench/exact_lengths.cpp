#include "bench/exact_lengths.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace raylign::detail::bench {
namespace {

/// A triangle in the camera, and its corners in pixels.
struct Projected {
    std::array<Eigen::Vector3d, 3> camera_mm;
    std::array<Eigen::Vector2d, 3> pixel;
};

/// Adds the signed length [mm] from the source to where the triangle is met, to every pixel whose centre it covers. On
/// an edge of two triangles a ray belongs to one of them: the top-left rule on exact products of doubles.
void add_triangle(const Projected& t, const Camera& camera, std::vector<double>& length_mm) {
    const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); };
    const double area = cross(t.pixel[1] - t.pixel[0], t.pixel[2] - t.pixel[0]);
    if (area == 0) return;
    const double sign = area > 0 ? 1 : -1;
    Eigen::Vector2d low = t.pixel[0], high = t.pixel[0];
    for (const Eigen::Vector2d& p : t.pixel) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    const Eigen::Vector3d normal = (t.camera_mm[1] - t.camera_mm[0]).cross(t.camera_mm[2] - t.camera_mm[0]);
    const double offset = normal.dot(t.camera_mm[0]);
    const Eigen::Matrix3d rays = camera.intrinsics_px.inverse();
    const int x1 = std::min(camera.size_px.x() - 1, static_cast<int>(std::floor(high.x())));
    const int y1 = std::min(camera.size_px.y() - 1, static_cast<int>(std::floor(high.y())));
    for (int y = std::max(0, static_cast<int>(std::ceil(low.y()))); y <= y1; ++y) {
        for (int x = std::max(0, static_cast<int>(std::ceil(low.x()))); x <= x1; ++x) {
            bool is_inside = true;
            for (std::size_t i = 0; i < 3 && is_inside; ++i) {
                const Eigen::Vector2d edge = sign * (t.pixel[(i + 1) % 3] - t.pixel[i]);
                const double side = cross(edge, Eigen::Vector2d(x, y) - t.pixel[i]);
                is_inside = side > 0 || (side == 0 && (edge.y() < 0 || (edge.y() == 0 && edge.x() > 0)));
            }
            if (!is_inside) continue;
            const Eigen::Vector3d ray = rays * Eigen::Vector3d(x, y, 1);
            const double met_mm = ray.norm() * offset / normal.dot(ray);
            length_mm[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.size_px.x()) +
                      static_cast<std::size_t>(x)] += sign * met_mm;
        }
    }
}

}  // namespace

Image exact_lengths(const TriangleMesh& mesh, const ViewGeometry& view, const RigidTransform& world_from_ct) {
    const RigidTransform camera_from_ct = view.camera_from_world * world_from_ct;
    std::vector<Eigen::Vector3d> camera_mm;
    std::vector<Eigen::Vector2d> pixel;
    for (const Eigen::Vector3d& v : mesh.vertices_mm) {
        camera_mm.push_back(camera_from_ct * v);
        pixel.push_back((view.camera.intrinsics_px * camera_mm.back()).hnormalized());
    }
    Image image(view.camera.size_px.x(), view.camera.size_px.y());
    std::vector<double> sums(image.pixels.size());
    for (const TriangleMesh::Triangle& triangle : mesh.triangles) {
        Projected t;
        for (std::size_t i = 0; i < 3; ++i) {
            t.camera_mm[i] = camera_mm[static_cast<std::size_t>(triangle[i])];
            t.pixel[i] = pixel[static_cast<std::size_t>(triangle[i])];
        }
        add_triangle(t, view.camera, sums);
    }
    double all = 0;
    for (const double sum : sums) all += sum;
    for (std::size_t i = 0; i < sums.size(); ++i) image.pixels[i] = static_cast<float>(all < 0 ? -sums[i] : sums[i]);
    return image;
}

}  // namespace raylign::detail::bench

#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

namespace raylign::detail::test {

// Meshes of any type that has vertices_mm and triangles.

/// A box with its corners told once, faces outwards.
template <class Mesh>
Mesh box_mesh(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    Mesh mesh;
    for (int i = 0; i < 8; ++i) {
        mesh.vertices_mm.emplace_back(i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(),
                                      i & 4 ? high.z() : low.z());
    }
    mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return mesh;
}

/// A ball of `bands` times 2 `bands` facets, corners on the sphere.
template <class Mesh>
Mesh ball_mesh(const Eigen::Vector3d& centre, double radius_mm, int bands) {
    Mesh mesh;
    const auto at = [&](int band, int step) {
        const double polar = std::numbers::pi * band / bands, turn = std::numbers::pi * (step % (2 * bands)) / bands;
        return Eigen::Vector3d(centre + radius_mm * Eigen::Vector3d(std::sin(polar) * std::cos(turn),
                                                                    std::sin(polar) * std::sin(turn), std::cos(polar)));
    };
    const auto index = [&](int band, int step) {
        if (band == 0) return 0;
        if (band == bands) return 1;
        return 2 + (band - 1) * 2 * bands + step % (2 * bands);
    };
    mesh.vertices_mm = {at(0, 0), at(bands, 0)};
    for (int band = 1; band < bands; ++band) {
        for (int step = 0; step < 2 * bands; ++step) mesh.vertices_mm.push_back(at(band, step));
    }
    for (int band = 0; band < bands; ++band) {
        for (int step = 0; step < 2 * bands; ++step) {
            const int a = index(band, step), b = index(band + 1, step), c = index(band + 1, step + 1),
                      d = index(band, step + 1);
            if (band + 1 < bands) mesh.triangles.push_back({a, b, c});
            if (band > 0) mesh.triangles.push_back({a, c, d});
        }
    }
    return mesh;
}

template <class Mesh>
Mesh joined(Mesh a, const Mesh& b) {
    const auto first = static_cast<std::int32_t>(a.vertices_mm.size());
    a.vertices_mm.insert(a.vertices_mm.end(), b.vertices_mm.begin(), b.vertices_mm.end());
    for (const auto& t : b.triangles) a.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    return a;
}

template <class Mesh>
Mesh inside_out(Mesh mesh) {
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
    return mesh;
}

/// Every corner told anew, as STL does.
template <class Mesh>
Mesh soup(const Mesh& mesh) {
    Mesh apart;
    for (const auto& triangle : mesh.triangles) {
        const auto first = static_cast<std::int32_t>(apart.vertices_mm.size());
        for (const std::int32_t corner : triangle) {
            apart.vertices_mm.push_back(mesh.vertices_mm[static_cast<std::size_t>(corner)]);
        }
        apart.triangles.push_back({first, first + 1, first + 2});
    }
    return apart;
}

}  // namespace raylign::detail::test

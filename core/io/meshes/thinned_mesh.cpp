#include "core/io/meshes/thinned_mesh.h"

#include <meshoptimizer.h>

#include <vector>

namespace raylign::detail {

TriangleMesh thinned(const TriangleMesh& mesh, double error_mm) {
    const MeshBounds bounds = bounds_of(mesh);
    const double side_mm = bounds.largest_side_mm();
    if (!(side_mm > 0)) return mesh;
    std::vector<float> corners;  // from the middle: floats tell a ten-millionth of the side
    const Eigen::Vector3d middle = (bounds.low_mm + bounds.high_mm) / 2;
    for (const Eigen::Vector3d& vertex : mesh.vertices_mm) {
        for (const double along : vertex - middle) corners.push_back(static_cast<float>(along));
    }
    std::vector<unsigned> all, kept(3 * mesh.triangles.size());
    for (const TriangleMesh::Triangle& triangle : mesh.triangles) {
        for (const std::int32_t corner : triangle) all.push_back(static_cast<unsigned>(corner));
    }
    const std::size_t count =
        meshopt_simplify(kept.data(), all.data(), all.size(), corners.data(), mesh.vertices_mm.size(),
                         3 * sizeof(float), 0, static_cast<float>(error_mm / side_mm));
    TriangleMesh result;
    std::vector<std::int32_t> place(mesh.vertices_mm.size(), -1);
    for (std::size_t i = 0; i < count; ++i) {
        std::int32_t& at = place[kept[i]];
        if (at < 0) {
            at = static_cast<std::int32_t>(result.vertices_mm.size());
            result.vertices_mm.push_back(mesh.vertices_mm[kept[i]]);
        }
        if (i % 3 == 0) result.triangles.emplace_back();
        result.triangles.back()[i % 3] = at;
    }
    return result;
}

}  // namespace raylign::detail

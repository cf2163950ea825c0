#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace raylign::detail {

/// A surface of triangles as a file has it: perhaps open, inside out or with each corner told anew.
struct TriangleMesh {
    using Triangle = std::array<std::int32_t, 3>;  ///< positions in vertices_mm, counter-clockwise seen from outside
    std::vector<Eigen::Vector3d> vertices_mm;
    std::vector<Triangle> triangles;
};

struct MeshBounds {
    Eigen::Vector3d low_mm, high_mm;
    [[nodiscard]] double largest_side_mm() const { return (high_mm - low_mm).maxCoeff(); }
};
/// Of the vertices, of which there is at least one.
[[nodiscard]] MeshBounds bounds_of(const TriangleMesh& mesh);

/// Six times the volume of the tetrahedron between a triangle and `origin_mm`; summed over a closed surface that is
/// counter-clockwise seen from outside, six times its volume.
[[nodiscard]] double six_volumes_mm3(const TriangleMesh& mesh, const TriangleMesh::Triangle& triangle,
                                     const Eigen::Vector3d& origin_mm);

/// A closed surface, and what had to be done for it.
struct SolidMesh {
    TriangleMesh mesh;
    double volume_mm3 = 0;           ///< parts that lie in one another count twice
    std::vector<std::string> notes;  ///< joined vertices, closed holes, turned triangles
};

/// Makes a solid of what a file has: joins equal vertices (and, where the surface is open else, those less than 1e-5 of
/// its size apart), drops triangles without area and copies, closes holes of less than 5 % of the surface by fans,
/// turns triangles that their neighbours contradict, and surfaces that are inside out; a surface inside another that
/// faces inwards is a cavity and stays. Throws Error, naming `where`, for no triangles, a vertex that is not finite, a
/// surface that is open or one-sided, and one without volume.
[[nodiscard]] SolidMesh solid_of(TriangleMesh mesh, const std::string& where);

}  // namespace raylign::detail

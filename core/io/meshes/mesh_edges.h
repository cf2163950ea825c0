#pragma once

#include <vector>

#include "core/io/meshes/triangle_mesh.h"

namespace raylign::detail {

/// Vertices around a hole, in the direction in which the triangles that would close it run.
using MeshLoop = std::vector<std::int32_t>;

/// The rims of holes: the edges that are not run through as often one way as the other, chained. Empty for a closed
/// surface, however many triangles meet at its edges.
[[nodiscard]] std::vector<MeshLoop> open_loops(const TriangleMesh& mesh);

/// Pieces of surface: triangles reached from one another across edges of just two triangles.
struct MeshParts {
    std::vector<int> part_of;      ///< a triangle's
    std::vector<bool> is_against;  ///< it runs along an edge as its neighbour does; the fewer ones of its part
    int count = 0;
    bool is_one_sided = false;  ///< no way to turn triangles makes neighbours agree
};
[[nodiscard]] MeshParts parts_of(const TriangleMesh& mesh);

}  // namespace raylign::detail

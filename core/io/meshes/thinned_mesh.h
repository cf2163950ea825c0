#pragma once

#include "core/io/meshes/triangle_mesh.h"

namespace raylign::detail {

/// The mesh with fewer triangles where they are finer than `error_mm` can tell: edges are collapsed where quadrics say
/// that the surface moves by no more. Corners are some of the mesh's, and a closed surface stays closed.
[[nodiscard]] TriangleMesh thinned(const TriangleMesh& mesh, double error_mm);

}  // namespace raylign::detail

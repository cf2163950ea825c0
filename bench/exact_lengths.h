#pragma once

#include "core/io/meshes/triangle_mesh.h"
#include "raylign/image.h"
#include "raylign/rigid_transform.h"
#include "raylign/view.h"

namespace raylign::detail::bench {

/// The length [mm] of each pixel's ray inside a closed surface: the sum of the signed depths of the triangles that it
/// meets (one that is left counts plus, one that is entered minus: no sorting), turned so that lengths are positive.
[[nodiscard]] Image exact_lengths(const TriangleMesh& mesh, const ViewGeometry& view,
                                  const RigidTransform& world_from_ct);

}  // namespace raylign::detail::bench

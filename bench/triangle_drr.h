#pragma once

#include "core/io/meshes/triangle_mesh.h"
#include "raylign/backend.h"
#include "raylign/rigid_transform.h"
#include "raylign/view.h"

namespace raylign::detail::bench {

/// A DRR straight from a closed surface of triangles, as an engine of them would make it: no voxels, no sorting.
struct TriangleDrr {
    const TriangleMesh& mesh;
    double mu_per_mm = 0;
    int samples = 1;  ///< rays along a pixel's side: their mean share of the beam is what the pixel shows

    /// What the view shows, with its ceiling.
    [[nodiscard]] Image render(const View& view, const RigidTransform& world_from_ct) const;
    /// The same with derivatives from the triangles' planes: exact inside. Where a wall that the rays run along ends an
    /// outline, that is a jump of the length, of which they know nothing.
    [[nodiscard]] DrrWithDerivatives by_planes(const View& view, const RigidTransform& world_from_ct,
                                               const Eigen::Vector3d& centre_ct_mm) const;
    /// The same by differences of DRRs, `step_mm` to each side at `radius_mm`.
    [[nodiscard]] DrrWithDerivatives by_differences(const View& view, const RigidTransform& world_from_ct,
                                                    const Eigen::Vector3d& centre_ct_mm, double step_mm,
                                                    double radius_mm) const;
};

}  // namespace raylign::detail::bench

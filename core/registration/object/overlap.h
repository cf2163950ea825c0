#pragma once

#include <span>
#include <vector>

#include "core/registration/object/volume_sums.h"
#include "raylign/rigid_transform.h"
#include "raylign/view.h"
#include "raylign/volume.h"

namespace raylign::detail {

/// Points that stand for the object: voxel centres in a regular lattice of its grid, each with the attenuation of its
/// cell as weight.
struct ObjectSample {
    std::vector<Eigen::Vector3d> points_ct_mm;
    std::vector<double> weights;  ///< they sum to one
};
/// Throws Error where no voxel attenuates.
[[nodiscard]] ObjectSample sample_object(const Volume& volume);
[[nodiscard]] ObjectSample sample_object(const VolumeSums& volume, const VoxelGrid& grid);

/// True where the view shows the point on a pixel that counts.
[[nodiscard]] bool is_seen(const View& view, const Eigen::Vector3d& point_world_mm);

/// Share of the object in [0, 1] that a view shows on pixels that count.
[[nodiscard]] double seen_share(const ObjectSample& sample, const View& view, const RigidTransform& world_from_ct);

/// Share of a view's image in [0, 1] that the box around the object's visible points fills.
[[nodiscard]] double covered_share(const ObjectSample& sample, const View& view, const RigidTransform& world_from_ct);

/// The least share over the views.
[[nodiscard]] double least_seen_share(const ObjectSample& sample, std::span<const View> views,
                                      const RigidTransform& world_from_ct);

}  // namespace raylign::detail

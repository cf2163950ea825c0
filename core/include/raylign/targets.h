#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "raylign/camera.h"
#include "raylign/rigid_transform.h"
#include "raylign/volume.h"

namespace raylign {

/// Distances between where a pose puts targets and where the true pose puts them [Kraats05].
struct TargetErrors {
    std::vector<double> tre_mm;  ///< per target: |found x - true x|
    double mtre_mm = 0;          ///< mean of tre_mm
    /// Per view: mean distance of the projections, on the detector; NaN where sdd is unknown or a target lies in the
    /// source's plane or behind it.
    std::vector<double> mpd_mm;
    /// Per view: mean distance of the true point to the line from the source through the found point.
    std::vector<double> mrpd_mm;
    double mean_mrpd_mm = 0;  ///< over views; NaN without views
};

/// Throws Error for no targets.
[[nodiscard]] TargetErrors target_errors(const RigidTransform& found_world_from_ct,
                                         const RigidTransform& true_world_from_ct,
                                         std::span<const Eigen::Vector3d> targets_ct_mm,
                                         std::span<const ViewGeometry> views);

/// Mean distance only. Throws Error for no targets.
[[nodiscard]] double mean_target_error_mm(const RigidTransform& found_world_from_ct,
                                          const RigidTransform& true_world_from_ct,
                                          std::span<const Eigen::Vector3d> targets_ct_mm);

/// Mean of the targets. Throws Error for no targets.
[[nodiscard]] Eigen::Vector3d targets_centre_mm(std::span<const Eigen::Vector3d> targets_mm);

/// Default targets: centres of voxels of the object's dense part (above 200 HU where at least 1000 voxels are, else
/// above half of the densest), spread evenly: the dense part's bounding box is cut into cubic cells and each cell gives
/// its dense voxel nearest to the cell's centre. The cells' side is chosen so that about `count` of them hold dense
/// voxels; where there are fewer voxels, fewer targets come back. Deterministic. Throws Error for count outside [1,
/// 10000] and where no voxel is positive.
[[nodiscard]] std::vector<Eigen::Vector3d> default_targets_ct_mm(const Volume& volume, int count = 100);

/// A random rigid offset start = exp_about(scale * twist, centre_world) * truth, scaled so that its mTRE over the
/// targets is exactly `mtre_mm` (to 1e-9 of it, or the rounding of the targets' coordinates). The twist acts about the
/// targets' centre; axis of rotation and direction of translation are uniform on the sphere, the rotation's share of
/// the error uniform in [0, 1]. The rotation before scaling is at most 45 degrees: where the share asks for more (large
/// mTRE on a small object), and where the targets lie on the axis, translation makes up for it. Same seed, same start
/// on every machine. Throws Error for no targets or mtre_mm that is negative or not finite.
[[nodiscard]] RigidTransform perturbed_start(const RigidTransform& true_world_from_ct,
                                             std::span<const Eigen::Vector3d> targets_ct_mm, double mtre_mm,
                                             std::uint64_t seed);

}  // namespace raylign

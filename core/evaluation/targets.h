#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/camera.h"
#include "core/geometry/rigid_transform.h"
#include "core/image/volume.h"

namespace raylign {

/// Distances between where a pose puts targets and where the true pose puts them [Kraats05].
struct TargetErrors {
    std::vector<double> tre_mm;  ///< per target: |found x - true x|
    double mtre_mm = 0;          ///< mean of tre_mm
    std::vector<double> mpd_mm;  ///< per view: mean distance of the projections, on the detector; NaN where sdd is unknown
    std::vector<double> mrpd_mm; ///< per view: mean distance of the true point to the line from the source through the found point
    double mean_mrpd_mm = 0;     ///< over views
};

[[nodiscard]] TargetErrors target_errors(const RigidTransform& found_world_from_ct, const RigidTransform& true_world_from_ct,
                                         std::span<const Eigen::Vector3d> targets_ct_mm,
                                         std::span<const ViewGeometry> views);

/// Mean distance only.
[[nodiscard]] double mean_target_error_mm(const RigidTransform& found_world_from_ct,
                                          const RigidTransform& true_world_from_ct,
                                          std::span<const Eigen::Vector3d> targets_ct_mm);

/// Default targets: points on a regular grid over the object's region (voxels above `bone_threshold_per_mm`, by default the
/// object's dense part), deterministic, about `count` of them. Throws Error where no voxel is above the threshold.
[[nodiscard]] std::vector<Eigen::Vector3d> default_targets_ct_mm(const Volume& volume, int count = 100);

/// A random rigid offset of `start = exp_about(twist, centre) * truth` scaled so that its mTRE over the targets is exactly
/// `mtre_mm`: direction of rotation and translation uniform, their shares of the error random. Same seed, same start.
[[nodiscard]] RigidTransform perturbed_start(const RigidTransform& true_world_from_ct,
                                             std::span<const Eigen::Vector3d> targets_ct_mm, double mtre_mm,
                                             std::uint64_t seed);

}  // namespace raylign

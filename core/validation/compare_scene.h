#pragma once

#include <span>
#include <vector>

#include "core/validation/compare.h"

namespace raylign::detail::validation {

/// Throws Error for fewer than two backends and options out of range.
void check(const std::vector<NamedBackend>& backends, const CompareOptions& options);

/// Views halved until no side is longer than `longest_side_px`.
[[nodiscard]] std::vector<View> reduced(std::span<const View> views, int longest_side_px);

/// The given pose, then random ones whose mTRE from it is uniform from 0 to `spread_mm`.
[[nodiscard]] std::vector<RigidTransform> random_poses(const RigidTransform& given,
                                                       std::span<const Eigen::Vector3d> targets_ct_mm, int count,
                                                       double spread_mm, std::uint64_t seed);

/// The tolerance of final poses for images of these views: optimizers stop within a share of a pixel, which in coarse
/// images is more than the tolerance in mm. `object_world_mm`: where pixels are measured.
[[nodiscard]] Tolerance for_pixels(Tolerance tolerance, std::span<const View> views,
                                   const Eigen::Vector3d& object_world_mm);

}  // namespace raylign::detail::validation

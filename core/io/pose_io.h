#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

#include "core/geometry/rigid_transform.h"

namespace raylign {

/// Reads world_from_ct from pose.json or an ITK transform file (.tfm, .txt, .h5; Euler3D, VersorRigid3D or Affine).
/// ITK files hold the same direction as pose.json: they map ct points to world points (both LPS, mm).
[[nodiscard]] RigidTransform read_pose(const std::filesystem::path& path);

/// Writes pose.json, or an ITK AffineTransform_double_3_3 for .tfm; to a temporary name first.
void write_pose(const std::filesystem::path& path, const RigidTransform& world_from_ct);

/// Target points in ct [mm], one per row: JSON {"targets_ct_mm": [[x,y,z], ...]}, CSV x,y,z, or 3D Slicer .fcsv.
[[nodiscard]] std::vector<Eigen::Vector3d> read_targets(const std::filesystem::path& path);

}  // namespace raylign

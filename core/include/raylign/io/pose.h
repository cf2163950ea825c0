#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

#include "raylign/rigid_transform.h"

namespace raylign {

/// Reads world_from_ct from pose.json, an ITK transform file (.tfm, .txt, .h5; Euler3D, VersorRigid3D or Affine), or
/// JointTrack's .jts, .jtak or .jta with one pose (read_jointtrack_poses).
/// ITK files hold the inverse of pose.json, ct_from_world: they map world points to ct points (both LPS, mm), as ITK
/// and 3D Slicer expect. Resampling the CT with ITK by this file, or putting it under the transform in 3D Slicer, shows
/// it where the X-rays saw it.
/// DICOM Spatial Registration objects (1.2.840.10008.5.1.4.1.1.66.1, RIGID) hold world_from_ct as it is: their matrix
/// maps the CT's frame of reference to the object's. `ct`: a file of the CT, or empty; where both are DICOM, frames of
/// reference decide the direction, and that the pose belongs to this CT.
[[nodiscard]] RigidTransform read_pose(const std::filesystem::path& path, const std::filesystem::path& ct = {});

/// Writes pose.json, or for .tfm and .txt an ITK AffineTransform_double_3_3 of ct_from_world, or for .dcm a DICOM
/// Spatial Registration with the patient, study and frame of reference of `ct`, a DICOM file (see read_pose); to a
/// temporary name first. Throws Error where the CT has no frame of reference.
void write_pose(const std::filesystem::path& path, const RigidTransform& world_from_ct,
                const std::filesystem::path& ct = {});

/// Target points in ct [mm], one per row: JSON {"targets_ct_mm": [[x,y,z], ...]}, CSV x,y,z, or 3D Slicer
/// .fcsv or Markups JSON.
[[nodiscard]] std::vector<Eigen::Vector3d> read_targets(const std::filesystem::path& path);

}  // namespace raylign

#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <vector>

#include "raylign/grid.h"

namespace raylign::detail {

/// A volume of an Autoscoper trial: a multi-page TIFF.
struct TrialVolume {
    std::filesystem::path file;
    Eigen::Vector3d voxel_mm = Eigen::Vector3d::Ones();
    std::array<bool, 3> flips = {false, false, false};  ///< columns, rows, pages that are reversed on reading
};

/// One camera of an Autoscoper trial.
struct TrialCamera {
    std::filesystem::path mayacam;  ///< MayaCam 1 or 2
    std::filesystem::path frames;   ///< the folder of its images
};

/// What an Autoscoper trial (.cfg) says: mayaCam_csv, CameraRootDir, VolumeFile, VolumeFlip, VoxelSize. Its
/// RenderResolution, OptimizationOffsets and folders are Autoscoper's own business.
struct AutoscoperTrial {
    std::vector<TrialCamera> cameras;
    std::vector<TrialVolume> volumes;
};

/// Paths are relative to the trial's folder; those of versions before 1.1, which are relative to where Autoscoper was
/// started, where they are found there; backslashes are slashes. Throws Error naming the line for unknown keys and
/// counts that differ. Source: Autoscoper, Trial.cpp.
[[nodiscard]] AutoscoperTrial read_autoscoper_trial(const std::filesystem::path& path);

/// Whether a file is such a trial.
[[nodiscard]] bool is_autoscoper_trial(const std::filesystem::path& path);

/// Where the voxels of a flipped volume lie: the frame ct is that of the volume as Autoscoper shows it, so that voxel
/// (0, 0, 0) of the shown volume keeps its place. `whole`: the grid of the whole file, whose part `part` is.
[[nodiscard]] VoxelGrid flipped_grid(const VoxelGrid& part, const VoxelGrid& whole, const std::array<bool, 3>& flips);

}  // namespace raylign::detail

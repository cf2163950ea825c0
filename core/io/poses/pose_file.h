#pragma once

#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "raylign/io/trajectory.h"

namespace raylign::detail {

/// What files hold poses in, ours and those of other programs.
enum class PoseFileFormat { single, trajectory, tra, jointtrack, xmalab };

/// By the extension: .tra, .jts, .jtak, .jta; .csv by its first line; all else is a single pose (read_pose).
[[nodiscard]] PoseFileFormat pose_file_format(const std::filesystem::path& path);

/// What is needed to read some of them.
struct PoseFileOptions {
    std::vector<VoxelGrid> shown_grids;  ///< .tra: of the volumes of a line, as Autoscoper shows them
    TraReadOptions tra;                  ///< its unit is XMALab's, too
};

/// The poses of a file of any of these formats, a sequence an object. A single pose is frame 1.
[[nodiscard]] std::vector<PoseSequence> read_pose_file(const std::filesystem::path& path,
                                                       const PoseFileOptions& options = {});

/// The rows of a trajectory.csv of such poses, by frame and then object. A frame without a pose is missing.
[[nodiscard]] std::vector<TrajectoryRow> trajectory_rows(std::span<const PoseSequence> sequences);

}  // namespace raylign::detail

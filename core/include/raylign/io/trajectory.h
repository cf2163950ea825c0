#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "raylign/grid.h"
#include "raylign/rigid_transform.h"
#include "raylign/tracking.h"

namespace raylign {

/// One row of trajectory.csv.
struct TrajectoryRow {
    std::string object;
    TrackFrame frame;
};

/// trajectory.csv, a row per frame and object: object, frame, status, searched, recovered, translation x, y, z [mm] and
/// unit quaternion w >= 0, x, y, z of world_from_ct, jump_mm, cost, a column cost_VIEW per view, expected_error_mm,
/// time_s, reasons ("; " between them). The pose and what belongs to it are empty for frames that are lost or missing.
/// Texts with commas or quotes are quoted (RFC 4180); numbers read back exactly.
[[nodiscard]] std::string trajectory_header(std::span<const std::string> view_names);
[[nodiscard]] std::string trajectory_line(const TrajectoryRow& row, std::size_t view_count);

/// Reads such a file; view_names get the names in its header, where not null. A last line without a line feed was cut
/// off and is dropped. Throws Error naming the line that is no row.
[[nodiscard]] std::vector<TrajectoryRow> read_trajectory(const std::filesystem::path& path,
                                                         std::vector<std::string>* view_names = nullptr);

/// World_from_ct of a row, none where it is lost or missing.
[[nodiscard]] std::optional<RigidTransform> pose_of(const TrackFrame& frame);

/// The text of an Autoscoper .tra file as it saves and loads them by default: one line a frame, the 4x4 matrix row by
/// row, commas, mm, 16 "NaN" where there is no pose. The matrix maps Autoscoper's frame of the volume to the world of
/// the cameras: x = columns, y = rows from the last one up, z = -slices, in mm from the outer corner, so that voxel
/// (i, j, k) of W x H x D is at (sx (i + 1/2), sy (H - j - 1/2), -sz (k + 1/2)). `grid`: of the volume file that
/// Autoscoper shows, without its flips. Throws Error where its axes are left-handed: no rotation says that.
/// Source: Autoscoper's AutoscoperMainWindow::save_tracking_results, VolumeDescription and its ray casting kernel.
[[nodiscard]] std::string tra_text(std::span<const std::optional<RigidTransform>> world_from_ct, const VoxelGrid& grid);

/// ct coordinates from those of Autoscoper's volume frame.
[[nodiscard]] RigidTransform ct_from_autoscoper(const VoxelGrid& grid);

}  // namespace raylign

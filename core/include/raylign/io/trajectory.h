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

/// World_from_ct of one frame; none where the file says that there is no pose.
struct FramePose {
    int frame = 0;  ///< its number; in files without numbers: the line, from 1
    std::optional<RigidTransform> world_from_ct;
};

/// The poses of one object as a file of another program lists them.
struct PoseSequence {
    std::string object;  ///< "" where the file does not name it
    std::vector<FramePose> frames;
};

/// How the 16 numbers of a matrix follow each other.
enum class MatrixOrder { rows, columns };

/// What a .tra file does not say itself.
struct TraReadOptions {
    std::optional<MatrixOrder> order;  ///< default: told by where the last row, 0 0 0 1, stands; rows where both fit
    double unit_mm = 1;                ///< millimetres per unit of length: 10 where it was exported in centimetres
};

/// Reads an Autoscoper .tra file in any form that it exports: 16 numbers (by rows or columns) or 6 (x, y, z, yaw,
/// pitch, roll in degrees, R = Rz(yaw) Ry(pitch) Rx(roll)) a volume, with commas or blanks; a line with NaN has no
/// pose. Its matrices map Autoscoper's frame of a volume (see tra_text) to the world. `grids`: of the volumes in a
/// line, as Autoscoper shows them, flips done. Throws Error naming the line that is wrong. Source: Autoscoper's
/// load_tracking_results and CoordFrame::from_xyzypr.
[[nodiscard]] std::vector<PoseSequence> read_tra(const std::filesystem::path& path, std::span<const VoxelGrid> grids,
                                                 const TraReadOptions& options = {});

/// Reads JointTrack's poses (JT_EULER_312 in .jts; JTA_EULER_KINEMATICS in .jtak, JTA_EULER_POSE in .jta): a row a
/// frame, x, y, z [mm] and the rotations z, x, y [degrees], R = Rz Rx Ry, from the model's own coordinates to
/// JointTrack's world: the source in the origin, x to the right of the image, y up, z from the image to the source.
/// That is the world of a view that is read from JointTrack's calibration. NOT_OPTIMIZED is a frame without a pose.
/// Throws Error naming the line that is wrong. Source: JTML's pose_file_io and RenderEngine::SetPose.
[[nodiscard]] PoseSequence read_jointtrack_poses(const std::filesystem::path& path);

enum class JointTrackFlavour { jts, jtak };
/// The text of such a file.
[[nodiscard]] std::string jointtrack_text(const PoseSequence& sequence, JointTrackFlavour flavour);

/// Reads XMALab's rigid body transformations (CSV): a row a frame, 16 numbers a body, the 4x4 matrix column by column
/// with the translation in the cells 13 to 15; NaN has no pose. It maps the body's reference coordinates, those of its
/// reference points, to the world of the cameras. With a heading (NAME_R11, ...) or without, with a first column of
/// frames or without. Throws Error naming the line that is wrong. Source: XMALab's RigidBody::saveTransformations.
[[nodiscard]] std::vector<PoseSequence> read_xmalab_bodies(const std::filesystem::path& path, double unit_mm = 1);

/// Such a table of all bodies in one file, with a heading.
[[nodiscard]] std::string xmalab_text(std::span<const PoseSequence> bodies);

}  // namespace raylign

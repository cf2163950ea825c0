#include "readers.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "raylign/io/geometry.h"
#include "raylign/io/image.h"
#include "raylign/io/landmarks.h"
#include "raylign/io/pose.h"
#include "raylign/io/trajectory.h"
#include "raylign/io/views.h"
#include "raylign/io/volume.h"

namespace raylign::detail::test {
namespace {

void expect(bool holds, const char* what) {
    if (!holds) throw std::logic_error(what);
}

bool are_finite(const std::vector<float>& values) {
    return std::ranges::all_of(values, [](float value) { return std::isfinite(value); });
}

void check_rotation(const Eigen::Matrix3d& matrix, const char* what) {
    expect((matrix.transpose() * matrix - Eigen::Matrix3d::Identity()).norm() < 1e-6, what);
}

void check_pose(const RigidTransform& pose) {
    expect(is_finite(pose), "a pose that is not finite");
    check_rotation(pose.rotation, "a pose that is not rigid");
    expect(pose.rotation.determinant() > 0, "a pose that mirrors");
}

void check_view(const ViewGeometry& view) {
    check_pose(view.camera_from_world);
    const Eigen::Matrix3d& k = view.camera.intrinsics_px;
    expect(k.allFinite() && k(0, 0) > 0 && k(1, 1) > 0, "a camera without a focal length");
}

void check_grid(const VoxelGrid& grid) {
    expect((grid.spacing_mm.array() > 0).all() && grid.spacing_mm.allFinite(), "a spacing that is none");
    expect(grid.origin_mm.allFinite(), "an origin nowhere");
    check_rotation(grid.direction, "axes that are not at right angles");
}

void volume(const std::filesystem::path& path) {
    VolumeReadOptions options;
    options.spacing_mm = Eigen::Vector3d(1, 1, 2);
    if (path.extension() != ".tif") options.spacing_mm.reset();
    const VolumeFile file = read_volume(path, options);
    check_grid(file.volume.grid);
    expect(are_finite(file.volume.attenuation_per_mm), "a voxel that is not finite");
}

void label_map(const std::filesystem::path& path) {
    VoxelGrid like;
    like.size = {4, 3, 2};
    check_grid(read_label_map(path, like).grid);
}

void xray(const std::filesystem::path& path) {
    (void)xray_size_px(path);
    const XrayFile file(path);
    const RawXray first = file.frame(1);
    expect(first.image.pixels.size() ==
               static_cast<std::size_t>(first.image.width) * static_cast<std::size_t>(first.image.height),
           "an image of another size than its pixels");
}

void geometry(const std::filesystem::path& path) {
    GeometryHints hints;
    hints.size_px = Eigen::Vector2i(64, 48);
    if (geometry_format_of(path) == GeometryFormat::rtk) hints.pixel_pitch_mm = Eigen::Vector2d(2, 2);
    for (const GeometryView& view : read_geometry(path, hints)) check_view(view.geometry);
}

void views(const std::filesystem::path& path) {
    for (const View& view : read_views(path, ReadImages::never).views) check_view(view.geometry);
}

void pose(const std::filesystem::path& path) { check_pose(read_pose(path)); }

void landmarks(const std::filesystem::path& path) {
    for (const Landmark& landmark : read_landmarks(path)) expect(landmark.x_ct_mm.allFinite(), "a landmark nowhere");
}

void image_points(const std::filesystem::path& path) {
    for (const ImagePoint& point : read_image_points(path)) expect(point.pixel.allFinite(), "a point nowhere");
}

void targets(const std::filesystem::path& path) {
    for (const Eigen::Vector3d& target : read_targets(path)) expect(target.allFinite(), "a target nowhere");
}

void trajectory(const std::filesystem::path& path) {
    for (const TrajectoryRow& row : read_trajectory(path)) {
        if (const auto found = pose_of(row.frame)) check_pose(*found);
    }
}

void check_sequence(const PoseSequence& sequence) {
    for (const FramePose& frame : sequence.frames) {
        if (frame.world_from_ct) check_pose(*frame.world_from_ct);
    }
}

void autoscoper_poses(const std::filesystem::path& path) {
    VoxelGrid grid;
    grid.size = {4, 3, 2};
    for (const PoseSequence& sequence : read_tra(path, std::span(&grid, 1))) check_sequence(sequence);
}

void jointtrack_poses(const std::filesystem::path& path) { check_sequence(read_jointtrack_poses(path)); }

void xmalab_bodies(const std::filesystem::path& path) {
    for (const PoseSequence& sequence : read_xmalab_bodies(path)) check_sequence(sequence);
}

constexpr FuzzedReader kReaders[] = {
    {"nifti", ".nii", volume},
    {"nifti-gz", ".nii.gz", volume},
    {"meta", ".mha", volume},
    {"meta-header", ".mhd", volume},
    {"nrrd", ".nrrd", volume},
    {"tiff-volume", ".tif", volume},
    {"label-map", ".nii", label_map},
    {"tiff", ".tif", xray},
    {"png", ".png", xray},
    {"jpeg", ".jpg", xray},
    {"dicom", ".dcm", xray},
    {"geometry-dicom", ".dcm", geometry},
    {"geometry-text", ".txt", geometry},
    {"geometry-yaml", ".yml", geometry},
    {"geometry-xml", ".xml", geometry},
    {"views", ".json", views},
    {"pose", ".json", pose},
    {"pose-tfm", ".tfm", pose},
    {"pose-hdf5", ".h5", pose},
    {"landmarks", ".csv", landmarks},
    {"landmarks-fcsv", ".fcsv", landmarks},
    {"landmarks-json", ".json", landmarks},
    {"image-points", ".csv", image_points},
    {"image-points-json", ".json", image_points},
    {"targets", ".csv", targets},
    {"trajectory", ".csv", trajectory},
    {"poses-autoscoper", ".tra", autoscoper_poses},
    {"poses-jointtrack", ".jts", jointtrack_poses},
    {"poses-xmalab", ".csv", xmalab_bodies},
};

}  // namespace

std::span<const FuzzedReader> fuzzed_readers() { return kReaders; }

}  // namespace raylign::detail::test

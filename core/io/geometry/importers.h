#pragma once

#include <filesystem>
#include <vector>

#include "raylign/io/geometry.h"

namespace raylign::detail {

/// MayaCam 2 text (XMALab, Autoscoper): image size, camera matrix, rotation, translation. x_camera = R x_world + t in
/// mm, pixel = K x_camera / z with v down and pixel centres at integers; the size is width, height, as Autoscoper reads
/// it (its page says height, width). The detector's distance is not in the file. Source: Autoscoper, Camera.cpp.
[[nodiscard]] std::vector<GeometryView> read_mayacam2(const std::filesystem::path& path, const GeometryHints& hints);

/// MayaCam 1 (five lines of three numbers): position of the source; rotations about the camera's own x, y, z [degrees],
/// world_from_camera = Rz Ry Rx; place of the film (ignored); u0, v0, Z; scale, width, height (0 = 1024). The camera
/// looks along its -z, y up; u0 and v0 count pixels from 1, v0 from the bottom: cx = u0 - 1, cy = height - v0, f = |Z|.
/// Lengths are centimetres by the format's definition. Source: Autoscoper, Camera.cpp.
[[nodiscard]] std::vector<GeometryView> read_mayacam1(const std::filesystem::path& path, const GeometryHints& hints);

/// RTK's ThreeDCircularProjectionGeometry. With R = Rz(-inplane) Rx(-outofplane) Ry(-gantry) and x' = R x_world:
///   u = sdd (x' - source_x) / (sid - z') + source_x - projection_x [mm on the detector], v alike;
///   pixel = (u - origin) / spacing of the projection images, which the file does not hold.
/// Rows grow with +v, upwards: mirrored against the view from the source. The world is RTK's fixed frame (IEC 61217).
/// "sid" is RTK's word for the distance of source and isocentre.
/// Source: RTK, rtkThreeDCircularProjectionGeometry.cxx.
[[nodiscard]] std::vector<GeometryView> read_rtk(const std::filesystem::path& path, const GeometryHints& hints);

/// The text that plastimatch's drr writes: image centre (column, row), 3x4 matrix P, sad, sid (source to detector),
/// normal, extrinsic, intrinsic. pixel = centre + (P_1 x, P_2 x) / (P_3 x), integers are centres, rows down. The world
/// is the CT's LPS. The size is not in the file. Source: plastimatch, proj_matrix.cxx.
[[nodiscard]] std::vector<GeometryView> read_plastimatch(const std::filesystem::path& path, const GeometryHints& hints);

/// OpenCV FileStorage YAML: camera_matrix, R (3x3 or rotation vector) or rvec, T or tvec [mm], image_width and
/// image_height; x_camera = R x_world + T, pixel centres at integers. Or a 3x4 projection_matrix alone. Distortion is
/// to be undone on reading unless the hints say that it was. M1 and M2 with R and T are the two views of a stereo pair:
/// the world is camera 1's, and x_camera2 = R x_camera1 + T (OpenCV, stereoCalibrate).
[[nodiscard]] std::vector<GeometryView> read_opencv(const std::filesystem::path& path, const GeometryHints& hints);

/// JointTrack's calibration (JT_INTCALIB or JTA_INTCALIB): principal distance, x and y of the principal point from the
/// image's middle, pixel size, all in mm. With integer pixel centres, i to the right and j upwards from the last row,
///   i = W / 2 + (x_offset - distance X / Z) / pixel, j = H / 2 + (y_offset - distance Y / Z) / pixel
/// in JointTrack's world: the source in the origin, X to the right, Y up, Z from the image to the source. The size is
/// not in the file. Calibrations of two planes are refused. Source: JTML, ParseCalibration and RenderEngine.
[[nodiscard]] std::vector<GeometryView> read_jointtrack(const std::filesystem::path& path, const GeometryHints& hints);

/// The cameras of an Autoscoper trial (mayaCam_csv, MayaCam 1 or 2), called like their files.
[[nodiscard]] std::vector<GeometryView> read_autoscoper_cameras(const std::filesystem::path& path,
                                                                const GeometryHints& hints);

/// A row per view: source, the detector's middle, steps to the next column and the next row [mm of one world]; by a
/// heading, or as ASTRA's cone_vec without one. The detector's middle is pixel (size - 1) / 2.
/// Source: ASTRA toolbox, documentation of the projection geometry cone_vec.
[[nodiscard]] std::vector<GeometryView> read_vectors(const std::filesystem::path& path, const GeometryHints& hints);
/// Whether a text file is such a table.
[[nodiscard]] bool is_vectors_table(const std::filesystem::path& path);

/// The tags of a DICOM X-ray (XA, RF, DX, CR) or RT Image: see dicom_geometry.cpp.
[[nodiscard]] std::vector<GeometryView> read_dicom_geometry(const std::filesystem::path& path,
                                                            const GeometryHints& hints);

}  // namespace raylign::detail

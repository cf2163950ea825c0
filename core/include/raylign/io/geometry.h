#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "raylign/camera.h"

namespace raylign {

/// What is done to the pixels of a file on reading, so that columns, rows and the ray to the detector make a
/// right-handed frame: the image as it looks from the source.
enum class ImageFlip { none, columns, rows };

/// Distortion of an image (of lenses, image intensifiers): OpenCV's rational model, plumb bob where k4 = k5 = k6 = 0.
/// The ray (x, y, 1) of the camera is seen in the image as stored where a camera without distortion sees (x', y', 1):
///   x' = f x + 2 p1 x y + p2 (r2 + 2 x^2),  y' = f y + p1 (r2 + 2 y^2) + 2 p2 x y,  r2 = x^2 + y^2,
///   f = (1 + k1 r2 + k2 r2^2 + k3 r2^3) / (1 + k4 r2 + k5 r2^2 + k6 r2^3).
/// Source: OpenCV, module calib3d.
struct Distortion {
    double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0, k4 = 0, k5 = 0, k6 = 0;  ///< in OpenCV's order
};

/// Where a pixel of the undistorted image lies in the distorted one; `camera`: of both.
[[nodiscard]] Eigen::Vector2d distorted_px(const Camera& camera, const Distortion& distortion,
                                           const Eigen::Vector2d& pixel);
/// Where a pixel of the distorted image lies in the undistorted one: the inverse, by Newton's method. Throws Error
/// where the model does not reach the pixel.
[[nodiscard]] Eigen::Vector2d undistorted_px(const Camera& camera, const Distortion& distortion,
                                             const Eigen::Vector2d& pixel);

/// What a geometry file may lack or leave open. What it states itself wins; a contradiction is an Error.
struct GeometryHints {
    std::optional<Eigen::Vector2i> size_px;
    std::optional<Eigen::Vector2d> pixel_pitch_mm;      ///< RTK; DICOM without ImagerPixelSpacing
    std::optional<Eigen::Vector2d> detector_origin_mm;  ///< RTK: place of pixel (0, 0) on the detector
    std::optional<double> sdd_mm, sad_mm;
    std::optional<double> primary_angle_deg, secondary_angle_deg;  ///< DICOM without positioner angles
    std::optional<double> unit_mm;                                 ///< MayaCam 1: millimetres per unit of length
    std::optional<ImageFlip> flip;                                 ///< overrules the format's own
    std::optional<bool> undistorted;  ///< the images come undistorted: the file's distortion is not to be undone again
    int item = 0;  ///< projection (RTK) or frame (DICOM), from 1; 0 = all projections, or the first frame
};

/// One view of a geometry file.
struct GeometryView {
    std::string name;
    ViewGeometry geometry;                 ///< of the image after `flip`
    ImageFlip flip = ImageFlip::none;      ///< to be done to the stored pixels (and to masks drawn on them)
    std::optional<Distortion> distortion;  ///< of the image after `flip`, to be undone on reading
    std::vector<std::string> assumptions;  ///< conventions of the format that were applied, and what was guessed
    bool is_dicom = false;
    int frame = 0;                                   ///< DICOM: the frame meant, from 1
    std::optional<Eigen::Vector3d> isocentre_ct_mm;  ///< DICOM RT: the world's origin in patient coordinates
};

/// Of other tools' files.
enum class GeometryFormat { mayacam1, mayacam2, rtk, plastimatch, opencv, dicom, jointtrack, autoscoper, vectors };
[[nodiscard]] std::string_view format_name(GeometryFormat format);

/// Told by the contents: DICOM's mark, an XML root, the YAML directive, MayaCam 2's or JointTrack's first line, the
/// keys of an Autoscoper trial, rows of twelve numbers or a heading that names such columns (vectors), MayaCam 1's five
/// lines of three numbers, else plastimatch's numbers. Throws Error for a file that is none of these.
[[nodiscard]] GeometryFormat geometry_format_of(const std::filesystem::path& path);

/// Reads MayaCam 1 or 2, RTK's XML, plastimatch's matrix text, OpenCV's YAML, vectors (ASTRA's cone_vec), JointTrack's
/// calibration, the cameras of an Autoscoper trial or the tags of a DICOM X-ray. Throws Error naming what is missing,
/// what contradicts what, and images that would be mirrored (offering the flip that mends it).
[[nodiscard]] std::vector<GeometryView> read_geometry(const std::filesystem::path& path,
                                                      const GeometryHints& hints = {});

/// A file's text in another tool's format, for images as raylign has them (seen from the source). `notes` gets what the
/// reader of that file must know. Throws Error where the format cannot hold the view (skew, unknown sdd).
[[nodiscard]] std::string mayacam2_text(const ViewGeometry& view);
[[nodiscard]] std::string opencv_text(const ViewGeometry& view, const std::optional<Distortion>& distortion = {});
/// A table: a row per view with its name, source, detector_centre, right, down and size.
[[nodiscard]] std::string vectors_text(std::span<const ViewGeometry> views, std::span<const std::string> names);
[[nodiscard]] std::string plastimatch_text(const ViewGeometry& view);
[[nodiscard]] std::string rtk_text(std::span<const ViewGeometry> views, std::vector<std::string>& notes);

/// What is hardly so in an X-ray room: a detector at 1.5 mm (metres?), pixels of 150 mm (micrometres?), an image that
/// sees half the room. Each says what was probably meant. Empty for all usual geometries.
[[nodiscard]] std::vector<std::string> geometry_doubts(const ViewGeometry& view);

}  // namespace raylign

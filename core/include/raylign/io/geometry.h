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

/// What a geometry file may lack or leave open. What it states itself wins; a contradiction is an Error.
struct GeometryHints {
    std::optional<Eigen::Vector2i> size_px;
    std::optional<Eigen::Vector2d> pixel_pitch_mm;      ///< RTK; DICOM without ImagerPixelSpacing
    std::optional<Eigen::Vector2d> detector_origin_mm;  ///< RTK: place of pixel (0, 0) on the detector
    std::optional<double> sdd_mm, sad_mm;
    std::optional<double> primary_angle_deg, secondary_angle_deg;  ///< DICOM without positioner angles
    std::optional<double> unit_mm;                                 ///< MayaCam 1: millimetres per unit of length
    std::optional<ImageFlip> flip;                                 ///< overrules the format's own
    int item = 0;  ///< projection (RTK) or frame (DICOM), from 1; 0 = all projections, or the first frame
};

/// One view of a geometry file.
struct GeometryView {
    std::string name;
    ViewGeometry geometry;                 ///< of the image after `flip`
    ImageFlip flip = ImageFlip::none;      ///< to be done to the stored pixels (and to masks drawn on them)
    std::vector<std::string> assumptions;  ///< conventions of the format that were applied, and what was guessed
    bool is_dicom = false;
    int frame = 0;                                   ///< DICOM: the frame meant, from 1
    std::optional<Eigen::Vector3d> isocentre_ct_mm;  ///< DICOM RT: the world's origin in patient coordinates
};

/// Of other tools' files.
enum class GeometryFormat { mayacam1, mayacam2, rtk, plastimatch, opencv, dicom, jointtrack, autoscoper };
[[nodiscard]] std::string_view format_name(GeometryFormat format);

/// Told by the contents: DICOM's mark, an XML root, the YAML directive, MayaCam 2's or JointTrack's first line, the
/// keys of an Autoscoper trial, MayaCam 1's five lines of three numbers, else plastimatch's numbers. Throws Error for a
/// file that is none of these.
[[nodiscard]] GeometryFormat geometry_format_of(const std::filesystem::path& path);

/// Reads MayaCam 1 or 2, RTK's XML, plastimatch's matrix text, OpenCV's YAML, JointTrack's calibration, the cameras of
/// an Autoscoper trial or the tags of a DICOM X-ray. Throws Error naming what is missing, what contradicts what, and
/// images that would be mirrored (offering the flip that mends it).
[[nodiscard]] std::vector<GeometryView> read_geometry(const std::filesystem::path& path,
                                                      const GeometryHints& hints = {});

/// A file's text in another tool's format, for images as raylign has them (seen from the source). `notes` gets what the
/// reader of that file must know. Throws Error where the format cannot hold the view (skew, unknown sdd).
[[nodiscard]] std::string mayacam2_text(const ViewGeometry& view);
[[nodiscard]] std::string opencv_text(const ViewGeometry& view);
[[nodiscard]] std::string plastimatch_text(const ViewGeometry& view);
[[nodiscard]] std::string rtk_text(std::span<const ViewGeometry> views, std::vector<std::string>& notes);

}  // namespace raylign

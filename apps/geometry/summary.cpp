#include "apps/geometry/summary.h"

#include <cmath>
#include <numbers>
#include <optional>

#include "apps/shared/json_text.h"
#include "apps/shared/lines.h"
#include "core/base/linear_algebra.h"

namespace raylign::detail::apps {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

/// Wider than a summary's: of the longest label.
std::string view_line(const char* label, const std::string& text) { return line(label, text, 12); }

/// What would be shown as -0.000 with so many digits is 0.
double without_minus_zero(double value, int digits = 3) {
    return std::abs(value) < std::pow(10, -digits) / 2 ? 0 : value;
}

std::string point_text(const Eigen::Vector3d& p) {
    return format("(%.3f, %.3f, %.3f)", without_minus_zero(p.x()), without_minus_zero(p.y()),
                  without_minus_zero(p.z()));
}

Eigen::Vector2d middle_px(const ViewGeometry& view) {
    return (view.camera.size_px.cast<double>() - Eigen::Vector2d::Ones()) / 2;
}

/// Where the ray through a pixel meets the plane at `depth_mm` before the source.
Eigen::Vector3d at_depth(const ViewGeometry& view, const Eigen::Vector2d& pixel, double depth_mm) {
    const Eigen::Matrix3d camera_from_pixel = inverse_of(view.camera.intrinsics_px);
    const Eigen::Vector3d camera = (camera_from_pixel.leftCols<2>() * pixel + camera_from_pixel.col(2)) * depth_mm;
    return inverse(view.camera_from_world) * camera;
}

/// Depth of the world's origin; empty where it lies behind the source, or in it.
std::optional<double> isocentre_depth_mm(const ViewGeometry& view) {
    const double depth = view.camera_from_world.translation_mm.z();
    return depth > 1e-3 ? std::optional(depth) : std::nullopt;
}

/// Sides of the image at the isocentre's depth [mm].
Eigen::Vector2d field_mm(const ViewGeometry& view, double depth_mm) {
    const Eigen::Matrix3d& k = view.camera.intrinsics_px;
    return view.camera.size_px.cast<double>().cwiseQuotient(Eigen::Vector2d(k(0, 0), k(1, 1))) * depth_mm;
}

std::string flip_text(ImageFlip flip) {
    return flip == ImageFlip::none ? "none" : flip == ImageFlip::columns ? "columns" : "rows";
}

std::string isocentre_lines(const ViewGeometry& view) {
    const std::optional<double> depth = isocentre_depth_mm(view);
    if (view.camera_from_world.translation_mm.norm() < 1e-3) {
        return view_line("isocentre", "the world's origin is the source: a camera's own frame");
    }
    if (!depth) {
        return view_line("isocentre",
                         "the world's origin lies behind the source: right where it is another camera's or the room's; "
                         "mirrored where the object is near it");
    }
    const Eigen::Vector2d field = field_mm(view, *depth);
    const Eigen::Vector2d pixel = project(view, Eigen::Vector3d::Zero());
    return view_line(
               "isocentre",
               format(
                   "world's origin: %.3f mm before the source, at pixel (%.2f, %.2f)%s", *depth,
                   without_minus_zero(pixel.x(), 2), without_minus_zero(pixel.y(), 2),
                   (pixel - middle_px(view)).cwiseAbs().cwiseQuotient(view.camera.size_px.cast<double>()).maxCoeff() >
                           0.5
                       ? ", outside the image"
                       : "")) +
           view_line("field", format("%.1f x %.1f mm at the isocentre", field.x(), field.y()));
}

std::string view_text(const ViewSummary& summary) {
    const ViewGeometry& view = summary.geometry;
    const Eigen::Matrix3d& k = view.camera.intrinsics_px;
    std::string text = summary.name + "  (" + summary.format + ", " + summary.file.string() + ")\n";
    text += view_line("image",
                      format("%d x %d px", view.camera.size_px.x(), view.camera.size_px.y()) +
                          (summary.flip == ImageFlip::none ? "" : ", stored " + flip_text(summary.flip) + " reversed"));
    text += view_line(
        "K", format("fx %.4f  fy %.4f  cx %.4f  cy %.4f  skew %.4g px", k(0, 0), k(1, 1), k(0, 2), k(1, 2), k(0, 1)));
    if (summary.distortion) {
        const Distortion& d = *summary.distortion;
        text +=
            view_line("distortion", format("k1 %.6g, k2 %.6g, p1 %.6g, p2 %.6g, k3 %.6g, k4 %.6g, k5 %.6g, k6 %.6g: "
                                           "undone on reading",
                                           d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6));
    }
    text += view_line("source", point_text(source_world_mm(view)) + " mm in world");
    if (view.camera.sdd_mm) {
        const Eigen::Vector2d pitch = *view.camera.pixel_pitch_mm();
        text += view_line("detector",
                          point_text(at_depth(view, middle_px(view), *view.camera.sdd_mm)) +
                              " mm in world (image middle), sdd " +
                              format("%.3f mm, pixels %.5g x %.5g mm", *view.camera.sdd_mm, pitch.x(), pitch.y()));
    } else {
        text += view_line("detector", "distance unknown");
    }
    const Eigen::Matrix3d axes = view.camera_from_world.rotation;
    text += view_line("axes", "columns " + point_text(axes.row(0)) + ", rows " + point_text(axes.row(1)) + " in world");
    const CArmAngles angles = c_arm_angles(view.camera_from_world);
    text += view_line("angles", format("primary %+.3f, secondary %+.3f, in-plane %+.3f degrees (if the world is LPS)",
                                       without_minus_zero(angles.primary_deg), without_minus_zero(angles.secondary_deg),
                                       without_minus_zero(angles.in_plane_deg)));
    text += isocentre_lines(view);
    for (const std::string& assumption : summary.assumptions) text += view_line("assumed", assumption);
    for (const std::string& doubt : geometry_doubts(view)) text += view_line("doubt", doubt);
    return text;
}

Json view_json(const ViewSummary& summary) {
    const ViewGeometry& view = summary.geometry;
    const CArmAngles angles = c_arm_angles(view.camera_from_world);
    Json json = {
        {"name", summary.name},
        {"file", summary.file.string()},
        {"format", summary.format},
        {"size_px", {view.camera.size_px.x(), view.camera.size_px.y()}},
        {"flip", flip_text(summary.flip)},
        {"intrinsics", matrix_json(view.camera.intrinsics_px)},
        {"camera_from_world", matrix_json(to_matrix(view.camera_from_world))},
        {"projection_matrix", matrix_json(projection_matrix(view))},
        {"source_world_mm", vector_json(source_world_mm(view))},
        {"angles_deg",
         {{"primary", angles.primary_deg}, {"secondary", angles.secondary_deg}, {"in_plane", angles.in_plane_deg}}}};
    if (view.camera.sdd_mm) {
        json["sdd_mm"] = *view.camera.sdd_mm;
        json["pixel_pitch_mm"] = vector_json(*view.camera.pixel_pitch_mm());
        json["detector_world_mm"] = vector_json(at_depth(view, middle_px(view), *view.camera.sdd_mm));
    }
    if (const std::optional<double> depth = isocentre_depth_mm(view)) {
        json["sad_mm"] = *depth;
        json["field_at_isocentre_mm"] = vector_json(field_mm(view, *depth));
    }
    if (summary.distortion) {
        const Distortion& d = *summary.distortion;
        json["distortion"] = {d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6};
    }
    json["assumptions"] = summary.assumptions;
    json["doubts"] = geometry_doubts(view);
    return json;
}

}  // namespace

CArmAngles c_arm_angles(const RigidTransform& camera_from_world) {
    const Eigen::Vector3d d = camera_from_world.rotation.row(2).transpose();
    CArmAngles angles;
    angles.secondary_deg = std::asin(std::min(1.0, std::max(-1.0, d.z()))) * kDegrees;
    // Seen from the head or the feet the primary angle is open: it is set 0 and the in-plane angle takes the turn.
    const bool is_axial = std::hypot(d.x(), d.y()) < 1e-9;
    angles.primary_deg = is_axial ? 0 : std::atan2(d.x(), -d.y()) * kDegrees;
    const ViewGeometry arm = view_from_c_arm({.sad_mm = 1,
                                              .sdd_mm = 1,
                                              .primary_angle_deg = angles.primary_deg,
                                              .secondary_angle_deg = angles.secondary_deg,
                                              .pixel_pitch_mm = {1, 1},
                                              .size_px = {1, 1}});
    const Eigen::Matrix3d between = camera_from_world.rotation * arm.camera_from_world.rotation.transpose();
    angles.in_plane_deg = std::atan2(between(0, 1), between(0, 0)) * kDegrees;
    return angles;
}

std::string geometry_text(const std::vector<ViewSummary>& views) {
    std::string text;
    for (const ViewSummary& view : views) text += view_text(view);
    return text;
}

std::string geometry_json(const std::vector<ViewSummary>& views) {
    Json list = Json::array();
    for (const ViewSummary& view : views) list.push_back(view_json(view));
    return indented({{"raylign", 1}, {"views", list}});
}

}  // namespace raylign::detail::apps

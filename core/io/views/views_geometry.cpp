#include "core/io/views/views_geometry.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/geometry/camera.h"
#include "core/io/files/text.h"
#include "core/io/geometry/distortion.h"
#include "core/io/geometry/stored_projection.h"

namespace raylign::detail {
namespace {

using Size = std::optional<Eigen::Vector2i>;

constexpr double kSourceRadius_mm = 1e-3;  // a world whose origin is the source itself: a camera's own frame

RigidTransform camera_from_world(const JsonNode& view) {
    const JsonNode node = view.at("camera_from_world");
    return rigid_from_matrix(node.matrix<4, 4>(), node.where());
}

Eigen::Vector2d principal_point_px(const JsonNode& camera, const Eigen::Vector2i& size_px,
                                   std::vector<std::string>& notes) {
    if (camera.has("principal_point_px")) return camera.at("principal_point_px").vector<2>();
    const Eigen::Vector2d middle = (size_px.cast<double>() - Eigen::Vector2d::Ones()) / 2;
    notes.push_back(camera.place() + ".principal_point_px is not given: the image's middle, (" +
                    number_text(middle.x()) + ", " + number_text(middle.y()) + "), is assumed");
    return middle;
}

Eigen::Vector2d pixel_pitch_mm(const JsonNode& camera) {
    const JsonNode node = camera.at("pixel_pitch_mm");
    const Eigen::Vector2d pitch_mm = node.vector<2>();
    if (!(pitch_mm.minCoeff() > 0)) throw node.error("two positive numbers");
    return pitch_mm;
}

Eigen::Vector2i size_or_image(const JsonNode& view, const Size& image_size_px) {
    if (view.has("size_px")) return view.at("size_px").size_px();
    if (!image_size_px) throw Error(view.place() + ".size_px is missing in " + view.file() + ", and no image tells it");
    return *image_size_px;
}

ViewGeometry from_camera(const JsonNode& view, std::vector<std::string>& notes) {
    const JsonNode camera = view.at("camera");
    camera.allow_keys({"size_px", "sdd_mm", "pixel_pitch_mm", "principal_point_px"});
    const Eigen::Vector2i size_px = camera.at("size_px").size_px();
    return {camera_from_pitch(size_px, camera.at("sdd_mm").positive(), pixel_pitch_mm(camera),
                              principal_point_px(camera, size_px, notes)),
            camera_from_world(view)};
}

std::optional<ImageFlip> read_flip(const JsonNode& view) {
    if (!view.has("flip")) return std::nullopt;
    return static_cast<ImageFlip>(view.at("flip").one_of({"none", "columns", "rows"}));
}

/// The matrix is that of the pixels as stored.
ViewGeometry from_projection_matrix(const JsonNode& view, const Size& image_size_px, ImageFlip flip,
                                    std::vector<std::string>& notes) {
    const JsonNode node = view.at("projection_matrix");
    const Eigen::Vector2i size_px = size_or_image(view, image_size_px);
    ViewGeometry geometry =
        view_from_projection_matrix(flip_matrix(flip, size_px) * node.matrix<3, 4>(), size_px, node.where());
    if (view.has("sdd_mm")) geometry.camera.sdd_mm = view.at("sdd_mm").positive();
    if (geometry.camera_from_world.translation_mm.z() < -kSourceRadius_mm) {
        notes.push_back(node.place() +
                        ": the world's origin lies behind the source. If the object is near it the image is mirrored: "
                        "\"flip\": \"columns\" (or \"rows\") turns the pixels on reading");
    }
    return geometry;
}

ViewGeometry from_intrinsics(const JsonNode& view, const Size& image_size_px) {
    const JsonNode node = view.at("intrinsics");
    Camera camera{size_or_image(view, image_size_px), node.matrix<3, 3>(), std::nullopt};
    refuse_transposed(camera.intrinsics_px, node.place(), node.file());
    if (view.has("sdd_mm")) camera.sdd_mm = view.at("sdd_mm").positive();
    check_camera(camera, node.where());
    return {camera, camera_from_world(view)};
}

double angle_deg(const JsonNode& node) {
    const double angle = node.number();
    if (angle < -360 || angle > 360) throw node.error("in [-360, 360]");
    return angle;
}

ViewGeometry from_c_arm(const JsonNode& view, std::vector<std::string>& notes) {
    const JsonNode node = view.at("c_arm");
    node.allow_keys({"sad_mm", "sdd_mm", "primary_angle_deg", "secondary_angle_deg", "pixel_pitch_mm", "size_px",
                     "principal_point_px"});
    CArm c_arm;
    c_arm.sad_mm = node.at("sad_mm").positive();
    c_arm.sdd_mm = node.at("sdd_mm").positive();
    if (c_arm.sdd_mm < c_arm.sad_mm) {
        throw node.at("sdd_mm").error("at least sad_mm = " + number_text(c_arm.sad_mm) +
                                      " (the detector is behind the axis)");
    }
    c_arm.primary_angle_deg = angle_deg(node.at("primary_angle_deg"));
    c_arm.secondary_angle_deg = angle_deg(node.at("secondary_angle_deg"));
    c_arm.pixel_pitch_mm = pixel_pitch_mm(node);
    c_arm.size_px = node.at("size_px").size_px();
    c_arm.principal_point_px = principal_point_px(node, c_arm.size_px, notes);
    notes.push_back(node.place() + ": the world's origin is the isocentre, its axes are LPS of a supine patient");
    return view_from_c_arm(c_arm);
}

/// The one form that is given. Throws for none or several.
std::string form_of(const JsonNode& view) {
    constexpr std::array<const char*, 5> kForms = {"camera", "projection_matrix", "intrinsics", "c_arm", "geometry"};
    std::string form;
    for (const char* candidate : kForms) {
        if (!view.has(candidate)) continue;
        if (!form.empty()) {
            throw Error(view.where() + " gives its geometry twice, as \"" + form + "\" and as \"" + candidate +
                        "\": must be one of camera, projection_matrix, intrinsics, c_arm, geometry");
        }
        form = candidate;
    }
    if (form.empty()) {
        throw Error(view.where() +
                    " has no geometry: must give camera, projection_matrix, intrinsics, c_arm or "
                    "geometry");
    }
    return form;
}

/// Keys at the view's level that belong to other forms would be ignored, or contradict the form: refuse them.
void check_companions(const JsonNode& view, const std::string& form) {
    const bool takes_size = form == "projection_matrix" || form == "intrinsics" || form == "geometry";
    const bool takes_pose = form == "camera" || form == "intrinsics";
    if (!takes_pose && view.has("camera_from_world")) {
        throw Error(view.place() + ".camera_from_world in " + view.file() + " contradicts \"" + form +
                    "\", which says where the camera stands: must be left out");
    }
    if (view.has("distortion") && !takes_pose) {
        throw Error(view.place() + ".distortion in " + view.file() +
                    " goes with \"camera\" or \"intrinsics\", not with \"" + form + "\": must be left out");
    }
    for (const char* key : {"size_px", "sdd_mm"}) {
        if (takes_size || !view.has(key)) continue;
        throw Error(view.place() + "." + key + " in " + view.file() + " must be inside \"" + form + "\"");
    }
    for (const char* key : {"pixel_pitch_mm", "detector_origin_mm", "sad_mm", "primary_angle_deg",
                            "secondary_angle_deg", "unit_mm", "projection", "undistorted"}) {
        if (form == "geometry" || !view.has(key)) continue;
        throw Error(view.place() + "." + key + " in " + view.file() + " goes with \"geometry\", not with \"" + form +
                    "\": must be left out" +
                    (form == "projection_matrix" || form == "intrinsics" ? "" : " or inside it"));
    }
}

std::optional<double> optional_positive(const JsonNode& view, const char* key) {
    if (!view.has(key)) return std::nullopt;
    return view.at(key).positive();
}

}  // namespace

int read_count(const JsonNode& node) {
    const double number = node.number();
    if (number < 1 || number > 1e6 || number != std::round(number)) throw node.error("a whole number from 1");
    return static_cast<int>(number);
}

namespace {

GeometryHints read_hints(const JsonNode& view, const Size& image_size_px) {
    GeometryHints hints;
    hints.size_px = image_size_px;
    if (view.has("size_px")) hints.size_px = view.at("size_px").size_px();
    hints.sdd_mm = optional_positive(view, "sdd_mm");
    hints.sad_mm = optional_positive(view, "sad_mm");
    hints.unit_mm = optional_positive(view, "unit_mm");
    if (view.has("pixel_pitch_mm")) hints.pixel_pitch_mm = pixel_pitch_mm(view);
    if (view.has("detector_origin_mm")) hints.detector_origin_mm = view.at("detector_origin_mm").vector<2>();
    if (view.has("primary_angle_deg")) hints.primary_angle_deg = angle_deg(view.at("primary_angle_deg"));
    if (view.has("secondary_angle_deg")) hints.secondary_angle_deg = angle_deg(view.at("secondary_angle_deg"));
    hints.flip = read_flip(view);
    if (view.has("undistorted")) hints.undistorted = view.at("undistorted").boolean();
    if (view.has("projection")) hints.item = read_count(view.at("projection"));
    if (view.has("frame")) hints.item = read_count(view.at("frame"));
    if (view.has("projection") && view.has("frame")) throw view.error("given one of projection and frame");
    return hints;
}

GeometryView from_geometry_file(const JsonNode& view, const std::filesystem::path& folder, const Size& image_size_px,
                                std::vector<std::string>& notes) {
    const std::filesystem::path path = folder / view.at("geometry").string();
    std::vector<GeometryView> found = read_geometry(path, read_hints(view, image_size_px));
    if (found.size() > 1) {
        throw Error(path.string() + " has " + std::to_string(found.size()) + " projections: " + view.place() +
                    ".projection must say which, from 1");
    }
    for (const std::string& assumption : found.front().assumptions) {
        notes.push_back(view.at("name").string() + ": " + assumption);
    }
    return found.front();
}

}  // namespace

bool has_geometry_file(const JsonNode& view) { return view.has("geometry"); }

GeometryView read_view_geometry(const JsonNode& view, const std::filesystem::path& folder, const Size& image_size_px,
                                std::vector<std::string>& notes) {
    const std::string form = form_of(view);
    check_companions(view, form);
    if (form == "geometry") return from_geometry_file(view, folder, image_size_px, notes);
    GeometryView result;
    if (form == "camera") result.geometry = from_camera(view, notes);
    result.flip = read_flip(view).value_or(ImageFlip::none);
    if (form == "projection_matrix") {
        result.geometry = from_projection_matrix(view, image_size_px, result.flip, notes);
    }
    if (form == "intrinsics") result.geometry = from_intrinsics(view, image_size_px);
    if (form == "c_arm") result.geometry = from_c_arm(view, notes);
    if (view.has("distortion")) {
        const JsonNode node = view.at("distortion");
        result.distortion =
            settled_distortion(distortion_from(node.numbers(), node.place(), node.file()), {}, result.assumptions);
        for (const std::string& note : result.assumptions) notes.push_back(view.at("name").string() + ": " + note);
    }
    if (view.has("frame")) result.frame = read_count(view.at("frame"));
    check_camera(result.geometry.camera, view.where());
    return result;
}

}  // namespace raylign::detail

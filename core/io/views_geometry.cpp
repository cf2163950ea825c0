#include "core/io/views_geometry.h"

#include <algorithm>
#include <array>

#include "core/io/text.h"

namespace raylign::detail {
namespace {

using Size = std::optional<Eigen::Vector2i>;

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

ViewGeometry from_projection_matrix(const JsonNode& view, const Size& image_size_px) {
    const JsonNode node = view.at("projection_matrix");
    ViewGeometry geometry =
        view_from_projection_matrix(node.matrix<3, 4>(), size_or_image(view, image_size_px), node.where());
    if (view.has("sdd_mm")) geometry.camera.sdd_mm = view.at("sdd_mm").positive();
    return geometry;
}

ViewGeometry from_intrinsics(const JsonNode& view, const Size& image_size_px) {
    const JsonNode node = view.at("intrinsics");
    Camera camera{size_or_image(view, image_size_px), node.matrix<3, 3>(), std::nullopt};
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
    constexpr std::array<const char*, 4> kForms = {"camera", "projection_matrix", "intrinsics", "c_arm"};
    std::string form;
    for (const char* candidate : kForms) {
        if (!view.has(candidate)) continue;
        if (!form.empty()) {
            throw Error(view.where() + " gives its geometry twice, as \"" + form + "\" and as \"" + candidate +
                        "\": must be one of camera, projection_matrix, intrinsics, c_arm");
        }
        form = candidate;
    }
    if (form.empty()) {
        throw Error(view.where() + " has no geometry: must give camera, projection_matrix, intrinsics or c_arm");
    }
    return form;
}

/// Keys at the view's level that belong to other forms would be ignored, or contradict the form: refuse them.
void check_companions(const JsonNode& view, const std::string& form) {
    const bool is_matrix = form == "projection_matrix" || form == "intrinsics";
    const bool takes_pose = form == "camera" || form == "intrinsics";
    if (!takes_pose && view.has("camera_from_world")) {
        throw Error(view.place() + ".camera_from_world in " + view.file() + " contradicts \"" + form +
                    "\", which says where the camera stands: must be left out");
    }
    for (const char* key : {"size_px", "sdd_mm"}) {
        if (is_matrix || !view.has(key)) continue;
        throw Error(view.place() + "." + key + " in " + view.file() + " must be inside \"" + form + "\"");
    }
}

}  // namespace

ViewGeometry read_view_geometry(const JsonNode& view, const Size& image_size_px, std::vector<std::string>& notes) {
    const std::string form = form_of(view);
    check_companions(view, form);
    ViewGeometry geometry;
    if (form == "camera") geometry = from_camera(view, notes);
    if (form == "projection_matrix") geometry = from_projection_matrix(view, image_size_px);
    if (form == "intrinsics") geometry = from_intrinsics(view, image_size_px);
    if (form == "c_arm") geometry = from_c_arm(view, notes);
    check_camera(geometry.camera, view.where());
    return geometry;
}

}  // namespace raylign::detail

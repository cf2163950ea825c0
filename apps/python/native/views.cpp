#include <cmath>
#include <optional>

#include "apps/python/native/bind.h"
#include "apps/python/native/interpreter.h"
#include "raylign/camera.h"
#include "raylign/error.h"
#include "raylign/intensity.h"
#include "raylign/io/pose.h"
#include "raylign/io/views.h"
#include "raylign/start.h"
#include "raylign/targets.h"
#include "raylign/view.h"

namespace raylign::detail::python {
namespace {

void check_image(const View& view, const Image& image, const std::string& what) {
    const Eigen::Vector2i& size = view.geometry.camera.size_px;
    if (image.empty() || (image.width == size.x() && image.height == size.y())) return;
    throw Error("view " + view.name + ": " + what + ": must have the shape (" + std::to_string(size.y()) + ", " +
                std::to_string(size.x()) + ") of the camera, has (" + std::to_string(image.height) + ", " +
                std::to_string(image.width) + ")");
}

Image optional_image(const py::object& object, const std::string& what) {
    return object.is_none() ? Image() : image_from(object, what);
}

Eigen::Vector2i size_from(const py::object& size_px, const std::string& view) {
    constexpr double kLargest = 65536;  // per side, as in files; more is a slip of the pen
    const auto size = vector_from<2>(size_px, "view " + view + ": size_px");
    for (int axis = 0; axis < 2; ++axis) {
        if (!(size[axis] >= 1 && size[axis] <= kLargest && size[axis] == std::floor(size[axis])))
            throw Error("size_px = " + py::str(size_px).cast<std::string>() + " in view " + view +
                        ": must be whole numbers in [1, 65536], columns and rows");
    }
    return size.cast<int>();
}

/// As files of views are checked.
void check_c_arm(const CArm& c_arm, const std::string& view) {
    const auto must = [&view](bool is_right, const char* what, double value, const std::string& allowed) {
        if (!is_right) {
            throw Error(what + (" = " + std::to_string(value)) + " in view " + view + ": must be " + allowed);
        }
    };
    const auto is_positive = [](double value) { return value > 0 && std::isfinite(value); };
    must(is_positive(c_arm.sad_mm), "sad_mm", c_arm.sad_mm, "positive");
    must(is_positive(c_arm.sdd_mm), "sdd_mm", c_arm.sdd_mm, "positive");
    must(c_arm.sdd_mm >= c_arm.sad_mm, "sdd_mm", c_arm.sdd_mm, "at least sad_mm = " + std::to_string(c_arm.sad_mm));
    for (int axis = 0; axis < 2; ++axis)
        must(is_positive(c_arm.pixel_pitch_mm[axis]), "pixel_pitch_mm", c_arm.pixel_pitch_mm[axis], "positive");
    must(std::abs(c_arm.primary_angle_deg) <= 360, "primary_deg", c_arm.primary_angle_deg, "in [-360, 360]");
    must(std::abs(c_arm.secondary_angle_deg) <= 360, "secondary_deg", c_arm.secondary_angle_deg, "in [-360, 360]");
}

View view_of(std::string name, const ViewGeometry& geometry, const py::object& image, const py::object& weights,
             double cost_weight) {
    View view{std::move(name), geometry, optional_image(image, "image"), optional_image(weights, "weights"),
              cost_weight};
    check_image(view, view.image, "image");
    check_image(view, view.weights, "weights");
    return view;
}

View from_camera(std::string name, const py::object& intrinsics_px, const py::object& camera_from_world,
                 const py::object& size_px, std::optional<double> sdd_mm, const py::object& image,
                 const py::object& weights, double cost_weight) {
    const ViewGeometry geometry{{size_from(size_px, name), matrix_from<3, 3>(intrinsics_px, "intrinsics"), sdd_mm},
                                pose_from(camera_from_world, "camera_from_world")};
    return view_of(std::move(name), geometry, image, weights, cost_weight);
}

View from_projection(std::string name, const py::object& matrix, const py::object& size_px, const py::object& image,
                     const py::object& weights, double cost_weight) {
    const ViewGeometry geometry = view_from_projection_matrix(matrix_from<3, 4>(matrix, "matrix"),
                                                              size_from(size_px, name), "projection of view " + name);
    return view_of(std::move(name), geometry, image, weights, cost_weight);
}

View from_c_arm(std::string name, double sad_mm, double sdd_mm, const py::object& size_px,
                const py::object& pixel_pitch_mm, double primary_deg, double secondary_deg,
                const py::object& principal_point_px, const py::object& image, const py::object& weights,
                double cost_weight) {
    CArm c_arm{.sad_mm = sad_mm,
               .sdd_mm = sdd_mm,
               .primary_angle_deg = primary_deg,
               .secondary_angle_deg = secondary_deg,
               .pixel_pitch_mm = vector_from<2>(pixel_pitch_mm, "pixel_pitch_mm"),
               .size_px = size_from(size_px, name)};
    if (!principal_point_px.is_none())
        c_arm.principal_point_px = vector_from<2>(principal_point_px, "principal_point_px");
    check_c_arm(c_arm, name);
    return view_of(std::move(name), view_from_c_arm(c_arm), image, weights, cost_weight);
}

py::array_t<double> projected(const View& view, const py::object& points) {
    const std::vector<Eigen::Vector3d> x_world = points_from(points, "points");
    py::array_t<double> pixels({static_cast<py::ssize_t>(x_world.size()), py::ssize_t{2}});
    for (std::size_t i = 0; i < x_world.size(); ++i) {
        const Eigen::Vector2d pixel = project(view.geometry, x_world[i]);
        for (int axis = 0; axis < 2; ++axis) pixels.mutable_at(static_cast<py::ssize_t>(i), axis) = pixel[axis];
    }
    return pixels;
}

/// Pixels as a detector stores them, as line integrals, with the pixels that are none and what was decided.
py::tuple line_integral(const py::object& pixels, const std::string& kind, const std::string& polarity,
                        std::optional<double> i0, bool auto_mask) {
    RawXray raw;
    raw.image = image_from(pixels, "pixels");
    const py::dtype type = py::array::ensure(pixels).dtype();
    raw.integer_pixels = type.kind() != 'f';
    if (raw.integer_pixels) raw.max_representable = std::exp2(8.0 * static_cast<double>(type.itemsize())) - 1;
    IntensitySettings settings{.i0 = i0, .auto_mask = auto_mask};
    if (kind == "line-integral") {
        settings.kind = IntensityKind::line_integral;
    } else if (kind == "transmission") {
        settings.kind = IntensityKind::transmission;
    } else if (kind != "auto") {
        throw Error("kind = " + kind + ": must be auto, line-integral or transmission");
    }
    if (polarity == "bone-bright") {
        settings.polarity = Polarity::bone_bright;
    } else if (polarity == "bone-dark") {
        settings.polarity = Polarity::bone_dark;
    } else if (polarity != "auto") {
        throw Error("polarity = " + polarity + ": must be auto, bone-bright or bone-dark");
    }
    XrayConversion made = line_integral_from_xray(raw, {}, settings, "pixels");
    return py::make_tuple(image_array(std::move(made.line_integral)), image_array(std::move(made.weights)),
                          made.decisions);
}

std::pair<std::vector<View>, std::vector<std::string>> read_xrays(const std::vector<std::string>& paths,
                                                                  bool needs_images, bool auto_mask) {
    const OthersMayRun others_may_run;
    ViewsReadOptions options;
    options.images = needs_images ? ReadImages::required : ReadImages::if_named;
    options.auto_mask = auto_mask;
    ViewsFile file = read_views(paths, options);
    return {std::move(file.views), std::move(file.notes)};
}

std::string view_repr(const View& view) {
    const Eigen::Vector2i& size = view.geometry.camera.size_px;
    return "<raylign.View " + view.name + ", " + std::to_string(size.x()) + " x " + std::to_string(size.y()) + " px, " +
           (view.image.empty() ? "no image" : "with image") + ">";
}

py::dict errors(const py::object& found, const py::object& truth, const py::object& targets,
                const std::vector<View>& views) {
    std::vector<ViewGeometry> geometry;
    for (const View& view : views) geometry.push_back(view.geometry);
    const TargetErrors made =
        target_errors(pose_from(found, "found"), pose_from(truth, "truth"), points_from(targets, "targets"), geometry);
    py::dict all;
    all["tre_mm"] = py::array_t<double>(static_cast<py::ssize_t>(made.tre_mm.size()), made.tre_mm.data());
    all["mtre_mm"] = made.mtre_mm;
    all["mpd_mm"] = made.mpd_mm;
    all["mrpd_mm"] = made.mrpd_mm;
    return all;
}

}  // namespace

void bind_views(py::module_& module) {
    using namespace py::literals;
    const auto none = py::none();
    py::class_<View>(module, "View")
        .def(py::init(&from_camera), "name"_a, "intrinsics"_a, "camera_from_world"_a, "size_px"_a, "sdd_mm"_a = none,
             "image"_a = none, "weights"_a = none, "cost_weight"_a = 1.0)
        .def_static("projection", &from_projection, "name"_a, "matrix"_a, "size_px"_a, "image"_a = none,
                    "weights"_a = none, "cost_weight"_a = 1.0)
        .def_static("c_arm", &from_c_arm, "name"_a, py::kw_only(), "sad_mm"_a, "sdd_mm"_a, "size_px"_a,
                    "pixel_pitch_mm"_a, "primary_deg"_a = 0.0, "secondary_deg"_a = 0.0, "principal_point_px"_a = none,
                    "image"_a = none, "weights"_a = none, "cost_weight"_a = 1.0)
        .def_readonly("name", &View::name)
        .def_readonly("cost_weight", &View::cost_weight)
        .def_property(
            "image", [](const View& view) { return image_array(view.image); },
            [](View& view, const py::object& pixels) {
                Image image = optional_image(pixels, "image");
                check_image(view, image, "image");
                view.image = std::move(image);
            })
        .def_property(
            "weights", [](const View& view) { return image_array(view.weights); },
            [](View& view, const py::object& pixels) {
                Image weights = optional_image(pixels, "weights");
                check_image(view, weights, "weights");
                view.weights = std::move(weights);
            })
        .def_property_readonly("size_px", [](const View& view) { return view.geometry.camera.size_px; })
        .def_property_readonly("intrinsics", [](const View& view) { return view.geometry.camera.intrinsics_px; })
        .def_property_readonly("sdd_mm", [](const View& view) { return view.geometry.camera.sdd_mm; })
        .def_property_readonly("camera_from_world",
                               [](const View& view) { return matrix_of(view.geometry.camera_from_world); })
        .def_property_readonly("projection_matrix", [](const View& view) { return projection_matrix(view.geometry); })
        .def_property_readonly("source", [](const View& view) { return source_world_mm(view.geometry); })
        .def("project", &projected, "points"_a)
        .def("__repr__", &view_repr);
    module.def("read_views", &read_xrays, "paths"_a, "needs_images"_a = true, "auto_mask"_a = false);
    module.def(
        "read_pose",
        [](const std::filesystem::path& path) {
            const OthersMayRun others_may_run;
            return matrix_of(read_pose(path));
        },
        "path"_a);
    module.def(
        "write_pose",
        [](const std::filesystem::path& path, const py::object& pose) { write_pose(path, pose_from(pose, "pose")); },
        "path"_a, "pose"_a);
    module.def("line_integral", &line_integral, "pixels"_a, py::kw_only(), "kind"_a = "auto", "polarity"_a = "auto",
               "i0"_a = none, "auto_mask"_a = false);
    module.def(
        "default_start",
        [](const Volume& volume, const std::vector<View>& views) {
            return matrix_of(default_start(volume.grid, views));
        },
        "volume"_a, "views"_a);
    module.def("target_errors", &errors, "found"_a, "truth"_a, "targets"_a, "views"_a = std::vector<View>());
    module.def(
        "perturbed_start",
        [](const py::object& truth, const py::object& targets, double mtre_mm, std::uint64_t seed) {
            return matrix_of(
                perturbed_start(pose_from(truth, "truth"), points_from(targets, "targets"), mtre_mm, seed));
        },
        "truth"_a, "targets"_a, "mtre_mm"_a, "seed"_a);
}

}  // namespace raylign::detail::python

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/error.h"
#include "core/geometry/camera.h"
#include "core/io/decode/small_files.h"
#include "core/io/files/text.h"
#include "core/io/geometry/distortion.h"
#include "core/io/geometry/importers.h"
#include "core/io/geometry/opencv_file.h"
#include "core/io/geometry/stored_projection.h"

namespace raylign {
using namespace detail;
namespace detail {
namespace {

constexpr std::array<std::string_view, 7> kIntrinsics = {"camera_matrix", "K", "cameraMatrix", "M1",
                                                         "intrinsics",    "M", "Camera_Matrix"};
constexpr std::array<std::string_view, 5> kRotation = {"R", "rvec", "rotation", "rotation_vector", "rotation_matrix"};
constexpr std::array<std::string_view, 6> kTranslation = {"T",       "tvec", "t", "translation", "translation_vector",
                                                          "position"};
constexpr std::array<std::string_view, 3> kProjection = {"projection_matrix", "P", "projectionMatrix"};
constexpr std::array<std::string_view, 2> kWidth = {"image_width", "width"};
constexpr std::array<std::string_view, 2> kHeight = {"image_height", "height"};
/// Of a stereo pair, followed by 1 and 2.
constexpr std::array<std::string_view, 6> kPairIntrinsics = {
    "M", "K", "cameraMatrix", "camera_matrix_", "camera_matrix", "cameraMatrix_"};
/// In lower case.
constexpr std::array<std::string_view, 9> kDistortionNames = {"d",
                                                              "dist",
                                                              "distortion",
                                                              "distcoef",
                                                              "distcoeffs",
                                                              "dist_coeff",
                                                              "dist_coeffs",
                                                              "distortion_coeffs",
                                                              "distortion_coefficients"};
constexpr std::array<std::string_view, 8> kCoefficients = {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};

/// A 3x3 matrix, or a rotation vector [rad].
Eigen::Matrix3d rotation_of(const OpencvFile& file, const std::string& where) {
    const std::string name = file.need(kRotation);
    const Eigen::MatrixXd m = file.matrix(name);
    if (m.size() == 3) {
        Twist twist = Twist::Zero();
        for (int i = 0; i < 3; ++i) twist[i] = m(i / m.cols(), i % m.cols());
        return exp(twist).rotation;
    }
    if (m.size() != 9) throw Error(name + " in " + where + ": must be 3 x 3, or 3 numbers [rad]");
    const Eigen::Matrix3d rotation = file.matrix(name, 3, 3);
    check_orthonormal(rotation, where);
    return rotation;
}

std::optional<Eigen::Vector2i> stated_size(const OpencvFile& file, const std::string& where) {
    const std::string width = file.first_of(kWidth), height = file.first_of(kHeight);
    if (width.empty() && height.empty()) return std::nullopt;
    const Eigen::Vector2d size(file.number(file.need(kWidth)), file.number(file.need(kHeight)));
    if (size != size.array().round().matrix() || !(size.cwiseAbs().maxCoeff() < 1e6)) {
        throw bad_value("image size", number_text(size.x()) + " x " + number_text(size.y()), "whole numbers", where);
    }
    return size.cast<int>();
}

Eigen::Matrix3d intrinsics_of(const OpencvFile& file, const std::string& name, const std::string& where) {
    const Eigen::Matrix3d k = file.matrix(name, 3, 3);
    refuse_transposed(k, name, where);
    return k;
}

/// Throws Error for a model other than OpenCV's own.
void check_model(const OpencvFile& file, const std::string& where) {
    for (const std::string& name : file.names()) {
        const std::string key = lower_case(name), model = lower_case(file.text(name));
        const bool says_model = key == "distortion_model" || key == "camera_model" || key == "model";
        const bool is_ours = model == "plumb_bob" || model == "rational_polynomial" || model == "radtan" ||
                             model == "pinhole" || model == "opencv" || model.empty();
        if ((says_model && !is_ours) || key.find("fisheye") != std::string::npos) {
            throw bad_value(name, says_model ? model : "given",
                            "plumb_bob or rational_polynomial (fisheye and other models are not known: undistort the "
                            "images, then leave the distortion out)",
                            where);
        }
    }
}

bool is_distortion_name(const std::string& name, const std::string& camera) {
    std::string key = lower_case(name);
    if (!camera.empty() && key.ends_with("_" + camera)) key.resize(key.size() - 2);
    if (!camera.empty() && key.ends_with(camera)) key.resize(key.size() - 1);
    const bool is_numbered = key != lower_case(name);
    return is_numbered == !camera.empty() && std::ranges::find(kDistortionNames, key) != kDistortionNames.end();
}

/// `camera`: "1" or "2" of a stereo pair, "" of a single one. Throws Error for what looks like distortion and is not
/// known by name: it must not be dropped.
std::optional<Distortion> distortion_of(const OpencvFile& file, const std::string& camera, const std::string& where) {
    check_model(file, where);
    std::string found;
    std::vector<double> numbers;
    for (const std::string& name : file.names()) {
        const bool is_known = is_distortion_name(name, camera) || (camera.empty() && is_distortion_name(name, "1"));
        const bool is_of_other = is_distortion_name(name, "1") || is_distortion_name(name, "2");
        if (!is_known && !is_of_other && lower_case(name).starts_with("dist") &&
            lower_case(name) != "distortion_model") {
            throw Error(name + " in " + where + ": is no name of distortion coefficients that is known; must be " +
                        "distortion_coefficients");
        }
        if (!is_known) continue;
        if (!found.empty()) throw Error(found + " and " + name + " in " + where + ": must be one of them");
        found = name;
        const Eigen::MatrixXd m = file.matrix(name);
        for (Eigen::Index i = 0; i < m.size(); ++i) numbers.push_back(m(i / m.cols(), i % m.cols()));
    }
    const bool has_scalars = std::ranges::any_of(kCoefficients, [&](auto key) { return file.has(std::string(key)); });
    if (!has_scalars) return found.empty() ? std::nullopt : distortion_from(numbers, found, where);
    if (!found.empty()) throw Error(found + " and k1, ... in " + where + ": must be one of them");
    for (const std::string_view key : kCoefficients) {
        numbers.push_back(file.has(std::string(key)) ? file.number(std::string(key)) : 0);
    }
    return distortion_from(numbers, "k1, k2, p1, p2, ...", where);
}

void refuse_foreign_opencv_hints(const GeometryHints& hints, const std::string& where) {
    for (const auto& [is_given, what] : {std::pair{hints.pixel_pitch_mm.has_value(), "pixel_pitch_mm"},
                                         {hints.detector_origin_mm.has_value(), "detector_origin_mm"},
                                         {hints.sad_mm.has_value(), "sad_mm"},
                                         {hints.unit_mm.has_value(), "unit_mm"},
                                         {hints.primary_angle_deg || hints.secondary_angle_deg, "an angle"}}) {
        refuse_hint(is_given, what, "OpenCV's YAML", where);
    }
}

void note_detector(StoredProjection& stored) {
    if (stored.sdd_mm) return;
    stored.assumptions.emplace_back(
        "the detector's distance is not in the file (sdd_mm may be given): rays run on behind the object without "
        "end");
}

std::string pair_name(const OpencvFile& file) {
    for (const std::string_view stem : kPairIntrinsics) {
        if (file.has(std::string(stem) + "1") && file.has(std::string(stem) + "2")) return std::string(stem);
    }
    return {};
}

/// One camera of a pair: the world is camera 1's.
GeometryView pair_view(const OpencvFile& file, const std::string& stem, int camera, const GeometryHints& hints,
                       const std::filesystem::path& path) {
    const std::string where = path.string() + ", camera " + std::to_string(camera), number = std::to_string(camera);
    StoredProjection stored;
    stored.size_px = settled_size(stated_size(file, where), hints, where);
    const Eigen::Matrix3d k = intrinsics_of(file, stem + number, where);
    check_camera({stored.size_px, k, hints.sdd_mm}, where);
    const bool is_first = camera == 1;
    const Eigen::Matrix3d rotation = is_first ? Eigen::Matrix3d::Identity() : rotation_of(file, where);
    const Eigen::Vector3d translation =
        is_first ? Eigen::Vector3d::Zero() : Eigen::Vector3d(file.matrix(file.need(kTranslation), 3, 1));
    stored.pixel_from_world = projection_of(k, rotation, translation);
    stored.sdd_mm = hints.sdd_mm;
    stored.assumptions = {
        "OpenCV, stereo pair: the world is camera 1's, x_camera2 = R x_camera1 + T in mm, rows down, pixel centres at "
        "integers, images as recorded (not rectified)"};
    note_detector(stored);
    stored.distortion = settled_distortion(distortion_of(file, number, where), hints, stored.assumptions);
    return finish_view(std::move(stored), hints, path.stem().string() + "_" + number, where);
}

std::vector<GeometryView> read_pair(const OpencvFile& file, const std::string& stem, const GeometryHints& hints,
                                    const std::filesystem::path& path) {
    if (hints.item < 0 || hints.item > 2) {
        throw bad_value("projection", std::to_string(hints.item), "1 or 2", path.string());
    }
    std::vector<GeometryView> views;
    for (int camera = 1; camera <= 2; ++camera) {
        if (hints.item == 0 || hints.item == camera) views.push_back(pair_view(file, stem, camera, hints, path));
    }
    return views;
}

/// Names that say something of the camera and were not looked at.
void note_unused(const OpencvFile& file, std::vector<std::string>& assumptions) {
    constexpr std::array<std::string_view, 7> kSaySomething = {"rectification_matrix", "binning_x", "binning_y", "roi",
                                                               "extrinsic_parameters", "R1",        "Q"};
    for (const std::string_view name : kSaySomething) {
        if (file.has(std::string(name))) assumptions.push_back(std::string(name) + " in the file is not used");
    }
}

void take_pose(const OpencvFile& file, const std::string& where, StoredProjection& stored) {
    const std::string name = file.first_of(kIntrinsics), projection = file.first_of(kProjection);
    const bool has_pose = !file.first_of(kRotation).empty() || !file.first_of(kTranslation).empty();
    if (!projection.empty() && name.empty() && !has_pose) {
        stored.pixel_from_world = file.matrix(projection, 3, 4);
        stored.assumptions = {"OpenCV: " + projection +
                              " maps world mm to pixels, rows down, pixel centres at integers"};
        return;
    }
    if (!projection.empty())
        stored.assumptions.push_back(projection + " in the file is not used: intrinsics and pose are");
    const Eigen::Matrix3d k = intrinsics_of(file, file.need(kIntrinsics), where);
    check_camera({stored.size_px, k, stored.sdd_mm}, where);
    const Eigen::Vector3d translation = file.matrix(file.need(kTranslation), 3, 1);
    stored.pixel_from_world = projection_of(k, rotation_of(file, where), translation);
    stored.assumptions.insert(stored.assumptions.begin(),
                              "OpenCV: x_camera = R x_world + T in mm, rows down, pixel centres at integers");
}

}  // namespace

std::vector<GeometryView> read_opencv(const std::filesystem::path& path, const GeometryHints& hints) {
    const std::string where = path.string();
    refuse_foreign_opencv_hints(hints, where);
    try_in_own_process(path, [](const std::filesystem::path& file) { (void)OpencvFile(file); });  // yaml-cpp
    const OpencvFile file(path);
    if (const std::string stem = pair_name(file); !stem.empty()) return read_pair(file, stem, hints, path);
    refuse_hint(hints.item != 0, "a frame or projection", "OpenCV's YAML of one camera", where);
    StoredProjection stored;
    stored.size_px = settled_size(stated_size(file, where), hints, where);
    stored.sdd_mm = hints.sdd_mm;
    take_pose(file, where, stored);
    note_detector(stored);
    note_unused(file, stored.assumptions);
    stored.distortion = settled_distortion(distortion_of(file, "", where), hints, stored.assumptions);
    return {finish_view(std::move(stored), hints, path.stem().string(), where)};
}

}  // namespace detail

std::string opencv_text(const ViewGeometry& view, const std::optional<Distortion>& distortion) {
    const auto matrix = [](const std::string& name, const Eigen::MatrixXd& m) {
        std::string text = name + ": !!opencv-matrix\n   rows: " + std::to_string(m.rows()) +
                           "\n   cols: " + std::to_string(m.cols()) + "\n   dt: d\n   data: [ ";
        for (Eigen::Index i = 0; i < m.size(); ++i) {
            // OpenCV's reader takes "1" for an integer, which it will not put into a matrix of doubles.
            std::string number = detail::number_text(m(i / m.cols(), i % m.cols()));
            if (number.find_first_of(".e") == std::string::npos) number += ".";
            text += (i > 0 ? ", " : "") + number;
        }
        return text + " ]\n";
    };
    std::string coefficients;
    if (distortion) {
        const Distortion& d = *distortion;
        Eigen::RowVectorXd numbers(8);
        numbers << d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6;
        if (d.k4 == 0 && d.k5 == 0 && d.k6 == 0) numbers.conservativeResize(5);
        coefficients = matrix("distortion_coefficients", numbers);
    }
    return "%YAML:1.0\n---\nimage_width: " + std::to_string(view.camera.size_px.x()) +
           "\nimage_height: " + std::to_string(view.camera.size_px.y()) + "\n" +
           matrix("camera_matrix", view.camera.intrinsics_px) + coefficients +
           matrix("R", view.camera_from_world.rotation) + matrix("T", view.camera_from_world.translation_mm);
}

}  // namespace raylign

#include <yaml-cpp/yaml.h>

#include <array>
#include <cmath>

#include "core/base/error.h"
#include "core/geometry/camera.h"
#include "core/io/decode/small_files.h"
#include "core/io/files/text.h"
#include "core/io/geometry/importers.h"
#include "core/io/geometry/number_text_reader.h"
#include "core/io/geometry/stored_projection.h"

namespace raylign {
using namespace detail;
namespace detail {
namespace {

/// A FileStorage file: maps names to matrices and numbers. Several programs spell them differently.
class OpencvFile {
public:
    explicit OpencvFile(const std::filesystem::path& path) : name_(path.string()) {
        std::string text;
        int written = 0;  // lines keep their numbers, for the parser's messages
        for (const TextLine& line : text_lines(path, KeepIndent::yes)) {
            for (; written < line.number - 1; ++written) text += "\n";
            // OpenCV writes "%YAML:1.0", which is no YAML directive.
            text += (line.text.starts_with("%YAML") ? "" : line.text) + "\n";
            ++written;
        }
        try {
            root_ = YAML::Load(text);
        } catch (const YAML::Exception& failure) {
            throw Error(name_ + " is not valid YAML: " + failure.what());
        }
        if (!root_.IsMap()) throw Error(name_ + " is no OpenCV file: must be a map of names");
    }

    /// The first of `names` that the file has; "" for none.
    [[nodiscard]] std::string first_of(std::span<const std::string_view> names) const {
        for (const std::string_view name : names) {
            if (root_[std::string(name)]) return std::string(name);
        }
        return {};
    }

    [[nodiscard]] std::string need(std::span<const std::string_view> names) const {
        const std::string name = first_of(names);
        if (name.empty()) throw Error(joined(names, " or ") + " is missing in " + name_ + " (OpenCV YAML)");
        return name;
    }

    [[nodiscard]] double number(const std::string& name) const { return number_of(root_[name], name); }

    /// A matrix (rows, cols, data), or a plain list of numbers as one column.
    [[nodiscard]] Eigen::MatrixXd matrix(const std::string& name) const {
        const YAML::Node node = root_[name];
        const bool is_list = node.IsSequence();
        const YAML::Node data = is_list ? node : node.IsMap() ? node["data"] : YAML::Node();
        if (!data || !data.IsSequence()) throw Error(name + " in " + name_ + ": must be an opencv-matrix");
        constexpr double kMost = 64;
        const double rows = is_list ? static_cast<double>(data.size()) : number_of(node["rows"], name + ".rows");
        const double cols = is_list ? 1 : number_of(node["cols"], name + ".cols");
        if (!(rows >= 1 && cols >= 1 && rows <= kMost && cols <= kMost) ||
            rows * cols != static_cast<double>(data.size())) {
            throw Error(name + " in " + name_ + ": must have rows x cols numbers in data");
        }
        Eigen::MatrixXd matrix(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(cols));
        for (std::size_t i = 0; i < data.size(); ++i) {
            const auto at = static_cast<Eigen::Index>(i);
            matrix(at / matrix.cols(), at % matrix.cols()) = number_of(data[i], name);
        }
        return matrix;
    }

    [[nodiscard]] Eigen::MatrixXd matrix(const std::string& name, Eigen::Index size) const {
        const Eigen::MatrixXd m = matrix(name);
        if (m.size() == size) return m;
        throw bad_value("size of " + name, std::to_string(m.rows()) + " x " + std::to_string(m.cols()),
                        std::to_string(size) + " numbers", name_);
    }

private:
    [[nodiscard]] double number_of(const YAML::Node& node, const std::string& what) const {
        const std::optional<double> number =
            node && node.IsScalar() ? number_from(node.Scalar()) : std::optional<double>();
        if (!number || !std::isfinite(*number)) throw Error(what + " in " + name_ + ": must be a finite number");
        return *number;
    }

    std::string name_;
    YAML::Node root_;
};

constexpr std::array<std::string_view, 5> kIntrinsics = {"camera_matrix", "K", "cameraMatrix", "M1", "intrinsics"};
constexpr std::array<std::string_view, 5> kRotation = {"R", "rvec", "rotation", "rotation_vector", "rotation_matrix"};
constexpr std::array<std::string_view, 6> kTranslation = {"T",       "tvec", "t", "translation", "translation_vector",
                                                          "position"};
constexpr std::array<std::string_view, 4> kDistortion = {"distortion_coefficients", "dist_coeffs", "D", "distCoeffs"};
constexpr std::array<std::string_view, 2> kWidth = {"image_width", "width"};
constexpr std::array<std::string_view, 2> kHeight = {"image_height", "height"};

/// A 3x3 matrix, or a rotation vector [rad].
Eigen::Matrix3d rotation_of(const OpencvFile& file, const std::string& where) {
    const std::string name = file.need(kRotation);
    const Eigen::MatrixXd m = file.matrix(name);
    if (m.size() == 3) {
        Twist twist = Twist::Zero();
        for (int i = 0; i < 3; ++i) twist[i] = m(i / m.cols(), i % m.cols());
        return exp(twist).rotation;
    }
    if (m.rows() != 3 || m.cols() != 3) throw Error(name + " in " + where + ": must be 3 x 3, or 3 numbers [rad]");
    check_orthonormal(m, where);
    return m;
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

void refuse_distortion(const OpencvFile& file, const std::string& where) {
    const std::string name = file.first_of(kDistortion);
    if (name.empty() || file.matrix(name).isZero(0)) return;
    throw Error(name + " in " + where + " is not 0: undistort the images first (cv::undistort), then set it to 0 here");
}

}  // namespace

std::vector<GeometryView> read_opencv(const std::filesystem::path& path, const GeometryHints& hints) {
    const std::string where = path.string();
    for (const auto& [is_given, what] : {std::pair{hints.pixel_pitch_mm.has_value(), "pixel_pitch_mm"},
                                         {hints.detector_origin_mm.has_value(), "detector_origin_mm"},
                                         {hints.sad_mm.has_value(), "sad_mm"},
                                         {hints.unit_mm.has_value(), "unit_mm"},
                                         {hints.primary_angle_deg || hints.secondary_angle_deg, "an angle"},
                                         {hints.item != 0, "a frame or projection"}}) {
        refuse_hint(is_given, what, "OpenCV's YAML", where);
    }
    try_in_own_process(path, [](const std::filesystem::path& file) { (void)OpencvFile(file); });  // yaml-cpp
    const OpencvFile file(path);
    refuse_distortion(file, where);
    const std::string intrinsics = file.need(kIntrinsics);
    const Eigen::MatrixXd k = file.matrix(intrinsics);
    if (k.rows() != 3 || k.cols() != 3) throw Error(intrinsics + " in " + where + ": must be 3 x 3");
    const Eigen::MatrixXd t = file.matrix(file.need(kTranslation), 3);
    const Eigen::Vector3d translation(t(0), t(1), t(2));
    StoredProjection stored;
    stored.size_px = settled_size(stated_size(file, where), hints, where);
    check_camera({stored.size_px, k, hints.sdd_mm}, where);
    stored.pixel_from_world = projection_of(k, rotation_of(file, where), translation);
    stored.sdd_mm = hints.sdd_mm;
    stored.assumptions = {"OpenCV: x_camera = R x_world + T in mm, rows down, pixel centres at integers"};
    if (!stored.sdd_mm) {
        stored.assumptions.emplace_back(
            "the detector's distance is not in the file (sdd_mm may be given): rays run on behind the object without "
            "end");
    }
    return {finish_view(std::move(stored), hints, path.stem().string(), where)};
}

}  // namespace detail

std::string opencv_text(const ViewGeometry& view) {
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
    return "%YAML:1.0\n---\nimage_width: " + std::to_string(view.camera.size_px.x()) +
           "\nimage_height: " + std::to_string(view.camera.size_px.y()) + "\n" +
           matrix("camera_matrix", view.camera.intrinsics_px) + matrix("R", view.camera_from_world.rotation) +
           matrix("T", view.camera_from_world.translation_mm);
}

}  // namespace raylign

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>

#include "core/base/error.h"
#include "core/geometry/camera.h"
#include "core/io/files/text.h"
#include "core/io/geometry/distortion.h"
#include "core/io/geometry/importers.h"
#include "core/io/geometry/number_text_reader.h"
#include "core/io/geometry/stored_projection.h"

namespace raylign {
using namespace detail;
namespace detail {
namespace {

/// The lines below a heading of MayaCam 2.
class Sections {
public:
    explicit Sections(const std::filesystem::path& path) : path_(path), lines_(text_lines(path)) {}

    /// `rows` lines of `columns` numbers below the line `heading`.
    [[nodiscard]] Eigen::MatrixXd matrix(std::string_view heading, int rows, int columns) const {
        for (std::size_t i = 0; i < lines_.size(); ++i) {
            if (lower_case(lines_[i].text) != heading) continue;
            Eigen::MatrixXd matrix(rows, columns);
            for (int r = 0; r < rows; ++r) {
                const std::size_t at = i + 1 + static_cast<std::size_t>(r);
                if (at >= lines_.size()) throw missing(heading, "ends too soon: " + std::to_string(rows) + " lines");
                const auto numbers =
                    line_numbers(lines_[at], static_cast<std::size_t>(columns), std::string(heading), path_);
                for (int c = 0; c < columns; ++c) matrix(r, c) = numbers[static_cast<std::size_t>(c)];
            }
            return matrix;
        }
        throw missing(heading, "is missing");
    }

    /// All numbers below the line `heading`; none where that is not there.
    [[nodiscard]] std::optional<std::vector<double>> numbers_below(std::string_view heading) const {
        std::vector<double> numbers;
        bool is_below = false;
        for (const TextLine& line : lines_) {
            const bool is_heading = !number_parts(line.text);
            if (is_below && is_heading) break;
            if (is_below) {
                const std::vector<double> more = *number_parts(line.text);
                numbers.insert(numbers.end(), more.begin(), more.end());
            }
            is_below = is_below || lower_case(line.text) == heading;
        }
        if (!is_below) return std::nullopt;
        return numbers;
    }

    /// Lines that are no numbers and no heading of `known`.
    [[nodiscard]] std::vector<std::string> headings_but(std::span<const std::string_view> known) const {
        std::vector<std::string> others;
        for (const TextLine& line : lines_) {
            const bool is_known = std::ranges::find(known, lower_case(line.text)) != known.end();
            if (!is_known && !number_parts(line.text)) others.push_back(line.text);
        }
        return others;
    }

private:
    [[nodiscard]] Error missing(std::string_view heading, const std::string& what) const {
        return Error("\"" + std::string(heading) + "\" " + what + " in " + path_.string() +
                     " (MayaCam 2 has image size, camera matrix, rotation, translation)");
    }

    std::filesystem::path path_;
    std::vector<TextLine> lines_;
};

constexpr std::array<std::string_view, 5> kMayaCam2 = {"image size", "camera matrix", "rotation", "translation",
                                                       "undistortion"};

/// XMALab's section: eight coefficients in OpenCV's order. Whether the images were exported undistorted only the user
/// knows, so it must be said.
std::optional<Distortion> mayacam_distortion(const Sections& file, const GeometryHints& hints,
                                             std::vector<std::string>& assumptions, const std::string& where) {
    const std::optional<std::vector<double>> numbers = file.numbers_below("undistortion");
    if (!numbers) return std::nullopt;
    const std::optional<Distortion> stated = distortion_from(*numbers, "undistortion", where);
    if (stated && !hints.undistorted) {
        throw Error(
            "\"undistortion\" in " + where + " is not 0 (" + distortion_text(*stated) +
            "): must be told by \"undistorted\" in views.json or --undistorted, true where the images were exported "
            "undistorted, false where they are raw and to be undistorted on reading");
    }
    return settled_distortion(stated, hints, assumptions);
}

Eigen::Vector2i whole_size(double width, double height, const std::string& where) {
    if (width != std::round(width) || height != std::round(height) || std::abs(width) > 1e6 || std::abs(height) > 1e6) {
        throw bad_value("image size", number_text(width) + " x " + number_text(height), "whole numbers", where);
    }
    return {static_cast<int>(width), static_cast<int>(height)};
}

/// Turns about x, y or z [degrees].
Eigen::Matrix3d turn(int axis, double angle_deg) {
    const double angle = angle_deg * std::numbers::pi / 180;
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
    matrix(a, a) = matrix(b, b) = std::cos(angle);
    matrix(b, a) = std::sin(angle);
    matrix(a, b) = -std::sin(angle);
    return matrix;
}

void refuse_foreign_hints(const GeometryHints& hints, std::string_view format, const std::string& where) {
    refuse_hint(hints.pixel_pitch_mm.has_value(), "pixel_pitch_mm", format, where);
    refuse_hint(hints.detector_origin_mm.has_value(), "detector_origin_mm", format, where);
    refuse_hint(hints.sad_mm.has_value(), "sad_mm", format, where);
    refuse_hint(hints.primary_angle_deg || hints.secondary_angle_deg, "an angle", format, where);
    refuse_hint(hints.item != 0, "a frame or projection", format, where);
}

void note_unknown_sdd(StoredProjection& stored) {
    if (stored.sdd_mm) return;
    stored.assumptions.emplace_back(
        "the detector's distance is not in the file (sdd_mm may be given): rays run on behind the object without end");
}

}  // namespace

std::vector<GeometryView> read_mayacam2(const std::filesystem::path& path, const GeometryHints& hints) {
    const std::string where = path.string();
    refuse_foreign_hints(hints, "MayaCam 2", where);
    refuse_hint(hints.unit_mm.has_value(), "unit_mm", "MayaCam 2", where);
    const Sections file(path);
    const Eigen::MatrixXd size = file.matrix("image size", 1, 2);
    const Eigen::Matrix3d intrinsics = file.matrix("camera matrix", 3, 3);
    const Eigen::Matrix3d rotation = file.matrix("rotation", 3, 3);
    const Eigen::Vector3d translation = file.matrix("translation", 3, 1);
    check_orthonormal(rotation, where);
    refuse_transposed(intrinsics, "camera matrix", where);
    StoredProjection stored;
    stored.size_px = settled_size(whole_size(size(0, 0), size(0, 1), where), hints, where);
    check_camera({stored.size_px, intrinsics, hints.sdd_mm}, where);
    stored.pixel_from_world = projection_of(intrinsics, rotation, translation);
    stored.sdd_mm = hints.sdd_mm;
    stored.assumptions = {
        "MayaCam 2: x_camera = R x_world + t in mm, rows down, pixel centres at integers, size as width, height"};
    note_unknown_sdd(stored);
    for (const std::string& heading : file.headings_but(kMayaCam2)) {
        if (lower_case(heading).find("distort") != std::string::npos) {
            throw bad_value("section", "\"" + heading.substr(0, 40) + "\"", "\"undistortion\", if it has coefficients",
                            where);
        }
        stored.assumptions.push_back("\"" + heading.substr(0, 40) + "\" in the file is not used");
    }
    stored.distortion = mayacam_distortion(file, hints, stored.assumptions, where);
    return {finish_view(std::move(stored), hints, path.stem().string(), where)};
}

std::vector<GeometryView> read_mayacam1(const std::filesystem::path& path, const GeometryHints& hints) {
    const std::string where = path.string();
    refuse_foreign_hints(hints, "MayaCam 1", where);
    refuse_hint(hints.undistorted.has_value(), "undistorted", "MayaCam 1", where);
    const std::vector<TextLine> lines = text_lines(path);
    if (lines.size() != 5)
        throw bad_value("lines", std::to_string(lines.size()), "5 of three numbers (MayaCam 1)", where);
    constexpr std::array<const char*, 5> kLines = {"source position", "rotation", "film position", "u0, v0, Z",
                                                   "scale, width, height"};
    std::array<Eigen::Vector3d, 5> rows;
    for (std::size_t i = 0; i < 5; ++i) {
        const std::vector<double> numbers = line_numbers(lines[i], 3, kLines[i], path);
        rows[i] = {numbers[0], numbers[1], numbers[2]};
    }
    StoredProjection stored;
    stored.assumptions = {
        "MayaCam 1: world_from_camera = Rz Ry Rx, the camera looks along -z with y up, u0 and v0 count "
        "from 1 and v0 from the bottom"};
    Eigen::Vector2i stated = whole_size(rows[4][1], rows[4][2], where);
    if (stated == Eigen::Vector2i::Zero()) {
        stated = hints.size_px.value_or(Eigen::Vector2i(1024, 1024));
        if (!hints.size_px) stored.assumptions.emplace_back("image size 0 in the file: 1024 x 1024 is assumed");
    }
    stored.size_px = settled_size(stated, hints, where);
    const double focal_px = -rows[3][2];
    if (!(focal_px > 0)) throw bad_value("Z", number_text(rows[3][2]) + " px", "negative (the film lies at -z)", where);
    // A source nearer than 3 m as centimetres; beyond, no X-ray room has it and the file must be in mm.
    const bool looks_like_mm = rows[0].norm() > 300;
    const double unit_mm = hints.unit_mm.value_or(looks_like_mm ? 1 : 10);
    stored.assumptions.push_back(hints.unit_mm ? "lengths in units of " + number_text(unit_mm) + " mm, as given"
                                 : looks_like_mm
                                     ? "lengths are taken as mm, since as cm the source would be " +
                                           number_text(rows[0].norm() / 100) + " m from the origin (unit_mm overrules)"
                                     : "lengths are cm, as the format says (unit_mm overrules)");
    Eigen::Matrix3d intrinsics = Eigen::Matrix3d::Identity();
    intrinsics << focal_px, 0, rows[3][0] - 1, 0, focal_px, stored.size_px.y() - rows[3][1], 0, 0, 1;
    const Eigen::Matrix3d world_from_maya = turn(2, rows[1].z()) * turn(1, rows[1].y()) * turn(0, rows[1].x());
    const Eigen::Matrix3d rotation = Eigen::Vector3d(1, -1, -1).asDiagonal() * world_from_maya.transpose();
    stored.pixel_from_world = projection_of(intrinsics, rotation, -rotation * rows[0] * unit_mm);
    stored.sdd_mm = hints.sdd_mm;
    note_unknown_sdd(stored);
    return {finish_view(std::move(stored), hints, path.stem().string(), where)};
}

}  // namespace detail

std::string mayacam2_text(const ViewGeometry& view) {
    using detail::number_text;
    const auto matrix = [](const Eigen::MatrixXd& m) {
        std::string text;
        for (Eigen::Index r = 0; r < m.rows(); ++r) {
            for (Eigen::Index c = 0; c < m.cols(); ++c) text += (c > 0 ? "," : "") + number_text(m(r, c));
            text += "\n";
        }
        return text;
    };
    return "image size\n" + std::to_string(view.camera.size_px.x()) + "," + std::to_string(view.camera.size_px.y()) +
           "\n\ncamera matrix\n" + matrix(view.camera.intrinsics_px) + "\nrotation\n" +
           matrix(view.camera_from_world.rotation) + "\ntranslation\n" + matrix(view.camera_from_world.translation_mm);
}

}  // namespace raylign

#include "raylign/io/trajectory.h"

#include <Eigen/Geometry>
#include <array>
#include <charconv>
#include <cmath>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"
#include "core/base/text.h"
#include "core/io/files/csv.h"
#include "core/io/files/text.h"
#include "core/io/files/text_file.h"

namespace raylign {
using namespace detail;
namespace {

using detail::number_text;

constexpr std::string_view kBefore = "object,frame,status,searched,recovered,x_mm,y_mm,z_mm,qw,qx,qy,qz,jump_mm,cost,";
constexpr std::string_view kAfter = "expected_error_mm,time_s,reasons";
constexpr std::size_t kColumnsBefore = 14, kColumnsAfter = 3;

std::string csv_text(const std::string& text) {
    if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
    std::string all = "\"";
    for (const char c : text) {
        if (c == '"') all += '"';
        all += c == '\n' || c == '\r' ? ' ' : c;
    }
    return all + "\"";
}

double number(const std::string& cell, const std::string& where) {
    const auto value = detail::number_from(cell);
    if (!value) throw bad_value("number", "\"" + cell + "\"", "a number", where);
    return *value;
}

TrackStatus status_from(const std::string& name, const std::string& where) {
    for (const TrackStatus status : {TrackStatus::ok, TrackStatus::doubtful, TrackStatus::lost, TrackStatus::missing}) {
        if (name == status_name(status)) return status;
    }
    throw bad_value("status", name, "ok, doubtful, lost or missing", where);
}

int frame_number(const std::string& cell, const std::string& where) {
    const double value = number(cell, where);
    if (value != std::round(value) || !(std::abs(value) < 1e9)) {
        throw bad_value("frame", cell, "a whole number below 1e9", where);
    }
    return static_cast<int>(value);
}

/// The names of the views in a header. Throws Error where it is not one that raylign writes.
std::vector<std::string> view_names_of(const std::vector<std::string>& cells, const std::filesystem::path& path) {
    constexpr std::string_view kCost = "cost_";
    std::vector<std::string> names;
    for (std::size_t i = kColumnsBefore; i + kColumnsAfter < cells.size(); ++i) {
        if (!cells[i].starts_with(kCost)) {
            throw bad_value("column " + std::to_string(i + 1), cells[i], "cost_VIEW", path.string() + ", line 1");
        }
        names.push_back(cells[i].substr(kCost.size()));
    }
    return names;
}

TrajectoryRow row_of(const std::vector<std::string>& cells, std::size_t view_count, const std::string& where) {
    TrajectoryRow row;
    TrackFrame& frame = row.frame;
    row.object = cells[0];
    frame.frame = frame_number(cells[1], where);
    frame.status = status_from(cells[2], where);
    frame.searched = search_from_name(cells[3]);
    frame.recovered = cells[4] == "1";
    if (pose_of(frame)) {
        std::array<double, 9> n{};
        for (std::size_t i = 0; i < n.size(); ++i) n[i] = number(cells[5 + i], where);
        for (std::size_t i = 0; i < 3; ++i) {
            if (!std::isfinite(n[i])) throw bad_value("translation", cells[5 + i], "finite [mm]", where);
        }
        const Eigen::Quaterniond turn(n[3], n[4], n[5], n[6]);
        if (!(std::abs(turn.norm() - 1) < 1e-6)) throw bad_value("quaternion", cells[8], "of length 1", where);
        frame.world_from_ct = {turn.normalized().toRotationMatrix(), {n[0], n[1], n[2]}};
        frame.jump_mm = n[7];
        frame.cost = n[8];
        for (std::size_t v = 0; v < view_count; ++v) {
            frame.view_costs.push_back(number(cells[kColumnsBefore + v], where));
        }
        frame.expected_error_mm = number(cells[kColumnsBefore + view_count], where);
    }
    frame.time_s = number(cells[kColumnsBefore + view_count + 1], where);
    std::string rest = cells.back();
    for (std::size_t end; !rest.empty(); rest = end == std::string::npos ? "" : rest.substr(end + 2)) {
        end = rest.find("; ");
        frame.reasons.push_back(rest.substr(0, end));
    }
    return row;
}

}  // namespace

std::optional<RigidTransform> pose_of(const TrackFrame& frame) {
    if (frame.status == TrackStatus::lost || frame.status == TrackStatus::missing) return std::nullopt;
    return frame.world_from_ct;
}

std::string trajectory_header(std::span<const std::string> view_names) {
    std::string line(kBefore);
    for (const std::string& name : view_names) line += "cost_" + name + ",";
    return line + std::string(kAfter) + "\n";
}

std::string trajectory_line(const TrajectoryRow& row, std::size_t view_count) {
    const TrackFrame& frame = row.frame;
    std::string line = csv_text(row.object) + "," + std::to_string(frame.frame) + "," +
                       std::string(status_name(frame.status)) + "," + std::string(search_name(frame.searched)) + "," +
                       (frame.recovered ? "1" : "0") + ",";
    if (const auto pose = pose_of(frame)) {
        Eigen::Quaterniond turn(pose->rotation);
        if (turn.w() < 0) turn.coeffs() *= -1;
        const Eigen::Vector3d& t = pose->translation_mm;
        for (const double value :
             {t.x(), t.y(), t.z(), turn.w(), turn.x(), turn.y(), turn.z(), frame.jump_mm, frame.cost}) {
            line += number_text(value) + ",";
        }
        for (std::size_t v = 0; v < view_count; ++v) {
            line += (v < frame.view_costs.size() ? number_text(frame.view_costs[v]) : "nan") + ",";
        }
        line += number_text(frame.expected_error_mm) + ",";
    } else {
        line += std::string(9 + view_count + 1, ',');
    }
    return line + number_text(frame.time_s) + "," + csv_text(joined(frame.reasons, "; ")) + "\n";
}

std::vector<TrajectoryRow> read_trajectory(const std::filesystem::path& path, std::vector<std::string>* view_names) {
    const std::string text = read_text_file(path);
    std::vector<TrajectoryRow> rows;
    std::size_t line_number = 0, begin = 0, view_count = 0;
    for (std::size_t end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
        const std::string where = path.string() + ", line " + std::to_string(++line_number);
        const std::vector<std::string> cells = csv_cells(std::string_view(text).substr(begin, end - begin), ',');
        if (line_number == 1) {
            const std::string_view header = std::string_view(text).substr(0, end);
            if (!header.starts_with(kBefore) || !header.ends_with(kAfter)) {
                throw Error(path.string() + " is not a trajectory of raylign track");
            }
            const std::vector<std::string> names = view_names_of(cells, path);
            view_count = names.size();
            if (view_names) *view_names = names;
            continue;
        }
        if (cells.size() != kColumnsBefore + view_count + kColumnsAfter) {
            throw bad_value("columns", std::to_string(cells.size()), "as many as in the header", where);
        }
        rows.push_back(row_of(cells, view_count, where));
    }
    return rows;
}

RigidTransform ct_from_autoscoper(const VoxelGrid& grid) {
    if (!(determinant_of(grid.direction) > 0)) {
        throw Error(
            "Autoscoper's frame of a volume with left-handed axes is no rotation of ct: rewrite it right-handed");
    }
    const Eigen::Vector3d corner(-0.5, grid.size.y() - 0.5, -0.5);  // voxel coordinates of its origin
    return {grid.direction * Eigen::Vector3d(1, -1, -1).asDiagonal(), grid.ct_from_voxel(corner)};
}

std::string tra_text(std::span<const std::optional<RigidTransform>> world_from_ct, const VoxelGrid& grid) {
    const RigidTransform ct_from_aut = ct_from_autoscoper(grid);
    std::string text;
    for (const auto& pose : world_from_ct) {
        const Eigen::Matrix4d matrix = pose ? to_matrix(*pose * ct_from_aut) : Eigen::Matrix4d::Identity();
        for (int i = 0; i < 16; ++i) {
            std::array<char, 64> digits{};
            const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), matrix(i / 4, i % 4),
                                           std::chars_format::fixed, 16);
            text += (i == 0 ? "" : ",") + (pose ? std::string(digits.data(), end.ptr) : "NaN");
        }
        text += "\n";
    }
    return text;
}

}  // namespace raylign

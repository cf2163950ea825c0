#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/error.h"
#include "core/io/files/text.h"
#include "core/io/poses/pose_text.h"
#include "raylign/io/trajectory.h"

namespace raylign {
using namespace detail;
namespace {

constexpr double kRadPerDegree = std::numbers::pi / 180;
constexpr const char* kNoPose = "NOT_OPTIMIZED";

/// R = Rz Rx Ry.
RigidTransform pose_from_euler_312(const std::vector<double>& n) {
    const auto turn = [](double angle_deg, int axis) {
        Twist twist = Twist::Zero();
        twist[axis] = angle_deg * kRadPerDegree;
        return exp(twist);
    };
    return RigidTransform::translate({n[0], n[1], n[2]}) * turn(n[3], 2) * turn(n[4], 0) * turn(n[5], 1);
}

/// z, x, y [degrees] with x in [-90, 90]; at its ends y is 0.
std::array<double, 3> euler_312_deg(const Eigen::Matrix3d& r) {
    const double x = std::asin(std::clamp(r(2, 1), -1.0, 1.0));
    constexpr double kEnd = 1e-9;  // of cos x: z and y turn about one axis there
    const bool is_locked = std::hypot(r(0, 1), r(1, 1)) < kEnd;
    const double z = is_locked ? std::atan2(r(1, 0), r(0, 0)) : std::atan2(-r(0, 1), r(1, 1));
    const double y = is_locked ? 0 : std::atan2(-r(2, 0), r(2, 2));
    return {z / kRadPerDegree, x / kRadPerDegree, y / kRadPerDegree};
}

FramePose jointtrack_frame(const PoseLine& line, int frame, const std::filesystem::path& path) {
    if (line.cells.front() == kNoPose) return {frame, std::nullopt};
    if (line.cells.size() != 6) {
        throw bad_value("columns", std::to_string(line.cells.size()), "6: x, y, z [mm], rotations z, x, y [degrees]",
                        line_name(path, line));
    }
    const std::vector<double> numbers = cell_numbers(line, path);
    if (has_nan(numbers)) return {frame, std::nullopt};
    return {frame, pose_from_euler_312(numbers)};
}

/// The column titles in the order that is read here; a file with another order is refused.
void check_titles(const PoseLine& line, const std::filesystem::path& path) {
    constexpr std::array<const char*, 6> kTitles = {"x_tran", "y_tran", "z_tran", "z_rot", "x_rot", "y_rot"};
    bool fits = line.cells.size() == kTitles.size();
    for (std::size_t i = 0; fits && i < kTitles.size(); ++i) fits = lower_case(line.cells[i]) == kTitles[i];
    if (fits) return;
    throw Error(line_name(path, line) + ": the titles must be x_tran, y_tran, z_tran, z_rot, x_rot, y_rot");
}

}  // namespace

PoseSequence read_jointtrack_poses(const std::filesystem::path& path) {
    const std::vector<PoseLine> lines = pose_lines(path);
    const std::string& first = lines.front().cells.front();
    if (first != "JT_EULER_312" && first != "JTA_EULER_KINEMATICS" && first != "JTA_EULER_POSE") {
        throw bad_value("first line", "\"" + first.substr(0, 40) + "\"",
                        "JT_EULER_312, JTA_EULER_KINEMATICS or JTA_EULER_POSE", path.string());
    }
    if (lines.size() < 3) throw Error(path.string() + " has no poses below its titles");
    check_titles(lines[1], path);
    PoseSequence sequence;
    for (std::size_t i = 2; i < lines.size(); ++i) {
        sequence.frames.push_back(jointtrack_frame(lines[i], static_cast<int>(i) - 1, path));
    }
    return sequence;
}

std::string jointtrack_text(const PoseSequence& sequence, JointTrackFlavour flavour) {
    const bool is_kinematics = flavour == JointTrackFlavour::jtak;
    std::string text = is_kinematics ? "JTA_EULER_KINEMATICS\nX_TRAN\t\tY_TRAN\t\tZ_TRAN\t\tZ_ROT\t\tX_ROT\t\tY_ROT\n"
                                     : "JT_EULER_312\nx_tran, y_tran, z_tran, z_rot, x_rot, y_rot\n";
    const std::string separator = is_kinematics ? ",\t" : ", ";
    for (const FramePose& frame : sequence.frames) {
        std::array<std::string, 6> cells;
        cells.fill(kNoPose);
        if (frame.world_from_ct) {
            const auto angles = euler_312_deg(frame.world_from_ct->rotation);
            for (int i = 0; i < 3; ++i) {
                cells[static_cast<std::size_t>(i)] = number_text(frame.world_from_ct->translation_mm[i]);
                cells[static_cast<std::size_t>(i) + 3] = number_text(angles[static_cast<std::size_t>(i)]);
            }
        }
        for (std::size_t i = 0; i < cells.size(); ++i) text += (i == 0 ? "" : separator) + cells[i];
        text += "\n";
    }
    return text;
}

}  // namespace raylign

#include <algorithm>
#include <cmath>
#include <span>

#include "core/base/error.h"
#include "core/io/files/text.h"
#include "core/io/poses/pose_text.h"
#include "raylign/io/trajectory.h"

namespace raylign {
using namespace detail;
namespace {

constexpr std::size_t kCells = 16;
constexpr const char* kSuffixes[kCells] = {"_R11", "_R12", "_R13", "_01", "_R21", "_R22", "_R23", "_02",
                                           "_R31", "_R32", "_R33", "_03", "_TX",  "_TY",  "_TZ",  "_1"};

bool is_body_heading(const PoseLine& line) {
    return std::ranges::any_of(line.cells, [](const std::string& cell) { return !number_from(cell); });
}

bool has_frame_column(const PoseLine& first) { return first.cells.size() % kCells == 1; }

/// The names before "_R11"; none without a heading.
std::vector<std::string> body_names(const PoseLine& first, std::size_t bodies) {
    std::vector<std::string> names(bodies);
    if (!is_body_heading(first)) return names;
    const std::size_t begin = has_frame_column(first) ? 1 : 0;
    for (std::size_t b = 0; b < bodies; ++b) {
        const std::string& title = first.cells[begin + b * kCells];
        names[b] = title.substr(0, title.rfind("_R11"));
    }
    return names;
}

/// Column by column: a turn's three columns and then the translation, each with its cell of the last row.
std::optional<RigidTransform> pose_from_columns(std::span<const double> n, double unit_mm, const std::string& where) {
    if (has_nan(n)) return std::nullopt;
    Eigen::Matrix4d matrix;
    for (int i = 0; i < 16; ++i) matrix(i % 4, i / 4) = n[static_cast<std::size_t>(i)];
    if (matrix(3, 0) != 0 || matrix(3, 1) != 0 || matrix(3, 2) != 0) {
        throw Error(where +
                    ": cells 4, 8 and 12 of a body must be 0, as XMALab writes them (column by column, the "
                    "translation in cells 13 to 15)");
    }
    RigidTransform pose = rigid_from_matrix(matrix, where);
    pose.translation_mm *= unit_mm;
    return pose;
}

int frame_number(double number, const std::string& where) {
    if (number == std::round(number) && std::abs(number) < 1e9) return static_cast<int>(number);
    throw bad_value("frame", number_text(number), "a whole number", where);
}

}  // namespace

std::vector<PoseSequence> read_xmalab_bodies(const std::filesystem::path& path, double unit_mm) {
    const std::vector<PoseLine> lines = pose_lines(path);
    const std::size_t columns = lines.front().cells.size();
    const bool has_frames = has_frame_column(lines.front());
    const std::size_t bodies = columns / kCells;
    if (bodies == 0 || columns % kCells > 1) {
        throw bad_value("columns", std::to_string(columns),
                        "16 for each rigid body (XMALab's transformations), or these after the frame", path.string());
    }
    std::vector<PoseSequence> sequences(bodies);
    const std::vector<std::string> names = body_names(lines.front(), bodies);
    for (std::size_t b = 0; b < bodies; ++b) sequences[b].object = names[b];
    const std::size_t first = is_body_heading(lines.front()) ? 1 : 0;
    if (first == lines.size()) throw Error(path.string() + " has no poses below its titles");
    for (std::size_t i = first; i < lines.size(); ++i) {
        const std::string where = line_name(path, lines[i]);
        const std::vector<double> numbers = cell_numbers(lines[i], path);
        if (numbers.size() != columns) {
            throw bad_value("columns", std::to_string(numbers.size()),
                            "as in the first line, " + std::to_string(columns), where);
        }
        const int frame = has_frames ? frame_number(numbers[0], where) : static_cast<int>(i - first) + 1;
        for (std::size_t b = 0; b < bodies; ++b) {
            const std::span<const double> cells(numbers.data() + (has_frames ? 1 : 0) + b * kCells, kCells);
            sequences[b].frames.push_back({frame, pose_from_columns(cells, unit_mm, where)});
        }
    }
    return sequences;
}

std::string xmalab_text(std::span<const PoseSequence> bodies) {
    std::string text;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const std::string name = bodies[b].object.empty() ? "RigidBody" + std::to_string(b + 1) : bodies[b].object;
        for (std::size_t i = 0; i < kCells; ++i) text += (b + i == 0 ? "" : ",") + name + kSuffixes[i];
        if (bodies[b].frames.size() != bodies[0].frames.size()) {
            throw Error("rigid bodies with different numbers of frames cannot stand in one of XMALab's tables");
        }
    }
    text += "\n";
    for (std::size_t f = 0; !bodies.empty() && f < bodies[0].frames.size(); ++f) {
        for (std::size_t b = 0; b < bodies.size(); ++b) {
            const auto& pose = bodies[b].frames[f].world_from_ct;
            const Eigen::Matrix4d matrix = pose ? to_matrix(*pose) : Eigen::Matrix4d::Zero();
            for (int i = 0; i < 16; ++i) {
                text += (b == 0 && i == 0 ? "" : ",") + (pose ? number_text(matrix(i % 4, i / 4)) : "NaN");
            }
        }
        text += "\n";
    }
    return text;
}

}  // namespace raylign

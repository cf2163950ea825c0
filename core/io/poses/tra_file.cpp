#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "core/base/error.h"
#include "core/io/files/text.h"
#include "core/io/poses/pose_text.h"
#include "raylign/io/trajectory.h"

namespace raylign {
using namespace detail;
namespace {

constexpr std::size_t kMatrix = 16, kAngles = 6;

enum class TraKind { matrix_by_rows, matrix_by_columns, angles };

/// x, y, z and yaw, pitch, roll [degrees]: about z, then the turned y, then the twice turned x.
RigidTransform pose_from_angles(std::span<const double> n) {
    const auto turn = [](double angle_deg, int axis) {
        Twist twist = Twist::Zero();
        twist[axis] = angle_deg * std::numbers::pi / 180;
        return exp(twist);
    };
    return RigidTransform::translate({n[0], n[1], n[2]}) * turn(n[3], 2) * turn(n[4], 1) * turn(n[5], 0);
}

RigidTransform pose_from_cells(std::span<const double> n, TraKind kind, double unit_mm, const std::string& where) {
    RigidTransform pose;
    if (kind == TraKind::angles) {
        pose = pose_from_angles(n);
    } else {
        Eigen::Matrix4d matrix;
        for (int i = 0; i < 16; ++i) {
            const int row = kind == TraKind::matrix_by_rows ? i / 4 : i % 4;
            matrix(row, kind == TraKind::matrix_by_rows ? i % 4 : i / 4) = n[static_cast<std::size_t>(i)];
        }
        pose = rigid_from_matrix(matrix, where);
    }
    pose.translation_mm *= unit_mm;
    return pose;
}

/// A row of zeros that a rigid matrix has: its last one, which stands last by rows and in every fourth cell by columns.
bool has_last_row(std::span<const double> n, TraKind kind) {
    const std::array<std::size_t, 3> cells =
        kind == TraKind::matrix_by_rows ? std::array<std::size_t, 3>{12, 13, 14} : std::array<std::size_t, 3>{3, 7, 11};
    return n[15] == 1 && std::ranges::all_of(cells, [&](std::size_t i) { return n[i] == 0; });
}

/// Whether every pose of every line could be a matrix in this order.
bool all_fit(const std::vector<std::vector<double>>& rows, TraKind kind) {
    return std::ranges::all_of(rows, [&](const std::vector<double>& row) {
        for (std::size_t at = 0; at + kMatrix <= row.size(); at += kMatrix) {
            const std::span<const double> cells(row.data() + at, kMatrix);
            if (!has_nan(cells) && !has_last_row(cells, kind)) return false;
        }
        return true;
    });
}

TraKind kind_of(const std::vector<std::vector<double>>& rows, std::size_t objects, const TraReadOptions& options,
                const std::string& where) {
    const std::size_t cells = rows.front().size();
    if (cells == kAngles * objects) return TraKind::angles;
    if (cells != kMatrix * objects) {
        const std::string count = std::to_string(objects);
        throw bad_value("numbers in a line", std::to_string(cells),
                        "16 (a matrix) or 6 (x, y, z, yaw, pitch, roll) for each of " + count + " volume" +
                            (objects == 1 ? " (several in a line: raylign poses FILE --trial takes one out)" : "s"),
                        where);
    }
    if (options.order) {
        return *options.order == MatrixOrder::rows ? TraKind::matrix_by_rows : TraKind::matrix_by_columns;
    }
    if (all_fit(rows, TraKind::matrix_by_rows)) return TraKind::matrix_by_rows;
    if (all_fit(rows, TraKind::matrix_by_columns)) return TraKind::matrix_by_columns;
    throw Error(where + ": its 16 numbers are no rigid 4x4 matrices, neither row by row nor column by column");
}

}  // namespace

std::vector<PoseSequence> read_tra(const std::filesystem::path& path, std::span<const VoxelGrid> grids,
                                   const TraReadOptions& options) {
    if (grids.empty()) throw Error(path.string() + " needs the volume that it moves: the poses are in its frame");
    const std::vector<PoseLine> lines = pose_lines(path);
    std::vector<std::vector<double>> rows;
    for (const PoseLine& line : lines) {
        rows.push_back(cell_numbers(line, path));
        if (rows.back().size() == rows.front().size()) continue;
        throw bad_value("numbers in a line", std::to_string(rows.back().size()),
                        "as many as in the first, " + std::to_string(rows.front().size()), line_name(path, line));
    }
    const TraKind kind = kind_of(rows, grids.size(), options, path.string());
    const std::size_t width = kind == TraKind::angles ? kAngles : kMatrix;
    std::vector<PoseSequence> sequences(grids.size());
    for (std::size_t object = 0; object < grids.size(); ++object) {
        const RigidTransform aut_from_ct = inverse(ct_from_autoscoper(grids[object]));
        for (std::size_t i = 0; i < rows.size(); ++i) {
            FramePose frame{static_cast<int>(i) + 1, std::nullopt};
            const std::span<const double> cells(rows[i].data() + object * width, width);
            if (!has_nan(cells)) {
                frame.world_from_ct =
                    pose_from_cells(cells, kind, options.unit_mm, line_name(path, lines[i])) * aut_from_ct;
            }
            sequences[object].frames.push_back(frame);
        }
    }
    return sequences;
}

}  // namespace raylign

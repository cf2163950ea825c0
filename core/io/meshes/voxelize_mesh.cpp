#include "core/io/meshes/voxelize_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>

#include "core/base/error.h"
#include "core/base/number_text.h"

namespace raylign::detail {
namespace {

// 25 lines a voxel, sheared so that no two have one x or one y: a flat face along z errs by a fiftieth of a voxel at
// most.
constexpr int kLines = 5;

/// A line along z enters (+1) or leaves (-1) the solid.
struct Crossing {
    int column;  ///< among the lines of a row of voxels
    double z;    ///< voxel coordinate
    int step;
};

/// A triangle in voxel coordinates.
struct VoxelTriangle {
    std::array<Eigen::Vector3d, 3> corner;

    [[nodiscard]] double low(int axis) const { return std::min({corner[0][axis], corner[1][axis], corner[2][axis]}); }
    [[nodiscard]] double high(int axis) const { return std::max({corner[0][axis], corner[1][axis], corner[2][axis]}); }
};

/// Twice the signed area of a, b, p in x and y. Two triangles that share an edge get the same number with opposite
/// signs, as it is always taken from the same end: no line slips between them.
double side_of(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double x, double y) {
    const bool is_swapped = std::pair(b.x(), b.y()) < std::pair(a.x(), a.y());
    const Eigen::Vector3d &from = is_swapped ? b : a, &to = is_swapped ? a : b;
    const double area = (to.x() - from.x()) * (y - from.y()) - (to.y() - from.y()) * (x - from.x());
    return is_swapped ? -area : area;
}

/// On the edge itself the triangle on one side has it: the one that runs upwards in (x, y).
bool is_left(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double area) {
    if (area != 0) return area > 0;
    return std::pair(a.x(), a.y()) < std::pair(b.x(), b.y());
}

void cross(const VoxelTriangle& triangle, double x, double y, int column, std::vector<Crossing>& crossings) {
    const auto& [a, b, c] = triangle.corner;
    const double to_c = side_of(a, b, x, y), to_a = side_of(b, c, x, y), to_b = side_of(c, a, x, y);
    const bool left = is_left(a, b, to_c);
    if (is_left(b, c, to_a) != left || is_left(c, a, to_b) != left) return;
    const double area = to_a + to_b + to_c;
    if (area == 0) return;
    const double z = (to_a * a.z() + to_b * b.z() + to_c * c.z()) / area;
    crossings.push_back({column, std::clamp(z, triangle.low(2), triangle.high(2)), left ? -1 : 1});
}

/// Place of line (i, j) of a voxel from its centre, along x; along y with i and j exchanged.
double line_at(int i, int j) { return (i + (j + 0.5) / kLines) / kLines - 0.5; }

/// Adds the part of [from, to] (voxel coordinates) in each voxel.
void add_length(double from, double to, float weight, int voxels, float* first, std::ptrdiff_t stride) {
    from = std::clamp(from + 0.5, 0.0, static_cast<double>(voxels));
    to = std::clamp(to + 0.5, 0.0, static_cast<double>(voxels));
    for (int k = static_cast<int>(from); k < voxels && k < to; ++k) {
        const double length = std::min(to, k + 1.0) - std::max(from, static_cast<double>(k));
        first[k * stride] += weight * static_cast<float>(length);
    }
}

class RowFiller {
public:
    RowFiller(const VoxelGrid& grid, MeshFill& fill) : grid_(grid), fill_(fill) {}

    /// All lines of one row of voxels: `crossings` in any order.
    void fill(int row, std::vector<Crossing>& crossings) {
        std::ranges::sort(crossings, {}, [](const Crossing& c) { return std::pair(c.column, c.z); });
        for (std::size_t begin = 0, end = 0; begin < crossings.size(); begin = end) {
            while (end < crossings.size() && crossings[end].column == crossings[begin].column) ++end;
            fill_line(row, {crossings.data() + begin, end - begin});
        }
    }

private:
    void fill_line(int row, std::span<const Crossing> line) {
        int winding = 0;
        for (const Crossing& crossing : line) winding += crossing.step;
        if (winding != 0) return;  // rounding at a corner, once in 1e12 lines: the others of the voxel stand for it
        const int x = line.front().column / (kLines * kLines);
        float* const first = &fill_.share[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid_.size.x()) +
                                          static_cast<std::size_t>(x)];
        const auto stride = static_cast<std::ptrdiff_t>(grid_.size.x()) * grid_.size.y();
        const double line_mm3 = grid_.spacing_mm.prod() / (kLines * kLines);
        for (std::size_t i = 0; i + 1 < line.size(); ++i) {
            winding += line[i].step;
            if (winding == 0) continue;
            const double from = line[i].z, to = line[i + 1].z;
            add_length(from, to, 1.0F / (kLines * kLines), grid_.size.z(), first, stride);
            if (winding != 1) fill_.crossing_mm3 += (to - from) * line_mm3;
        }
    }

    const VoxelGrid& grid_;
    MeshFill& fill_;
};

std::vector<VoxelTriangle> in_voxels(const TriangleMesh& mesh, const VoxelGrid& grid) {
    std::vector<Eigen::Vector3d> vertices;
    vertices.reserve(mesh.vertices_mm.size());
    for (const Eigen::Vector3d& v : mesh.vertices_mm) vertices.push_back(grid.voxel_from_ct(v));
    std::vector<VoxelTriangle> triangles;
    triangles.reserve(mesh.triangles.size());
    for (const TriangleMesh::Triangle& t : mesh.triangles) {
        triangles.push_back({{vertices[static_cast<std::size_t>(t[0])], vertices[static_cast<std::size_t>(t[1])],
                              vertices[static_cast<std::size_t>(t[2])]}});
    }
    return triangles;
}

/// Per row of voxels the triangles that reach it.
std::vector<std::vector<std::uint32_t>> by_row(const std::vector<VoxelTriangle>& triangles, int rows) {
    std::vector<std::vector<std::uint32_t>> list(static_cast<std::size_t>(rows));
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const int first = std::max(0, static_cast<int>(std::floor(triangles[i].low(1))));
        const int last = std::min(rows - 1, static_cast<int>(std::ceil(triangles[i].high(1))));
        for (int row = first; row <= last; ++row) {
            list[static_cast<std::size_t>(row)].push_back(static_cast<std::uint32_t>(i));
        }
    }
    return list;
}

}  // namespace

VoxelGrid grid_around(const MeshBounds& bounds, double spacing_mm, double most_voxels) {
    const Eigen::Vector3d side_mm = bounds.high_mm - bounds.low_mm;
    const Eigen::Vector3d size = (side_mm / spacing_mm).array().ceil() + 2;
    if (!(size.prod() <= most_voxels)) {
        throw bad_value("voxels of " + number_text(spacing_mm) + " mm", fixed(size.prod() / 1e6, 0) + " million",
                        "at most " + fixed(most_voxels / 1e6, 0) + " million: use larger ones");
    }
    VoxelGrid grid;
    grid.size = size.cast<int>();
    grid.spacing_mm.setConstant(spacing_mm);
    grid.origin_mm = (bounds.low_mm + bounds.high_mm) / 2 - spacing_mm * (size - Eigen::Vector3d::Ones()) / 2;
    return grid;
}

namespace {

/// The lines of a row of voxels that meet a triangle.
void cross_row(const VoxelTriangle& triangle, int row, int voxels, std::vector<Crossing>& crossings) {
    for (int line = 0; line < kLines * kLines; ++line) {
        const int i = line % kLines, j = line / kLines;
        const double y = row + line_at(j, i), offset = line_at(i, j);
        if (y < triangle.low(1) || y > triangle.high(1)) continue;
        const int first = std::max(0, static_cast<int>(std::floor(triangle.low(0) - offset)));
        const int last = std::min(voxels - 1, static_cast<int>(std::ceil(triangle.high(0) - offset)));
        for (int x = first; x <= last; ++x) cross(triangle, x + offset, y, x * kLines * kLines + line, crossings);
    }
}

}  // namespace

MeshFill voxelize_mesh(const TriangleMesh& mesh, const VoxelGrid& grid) {
    MeshFill fill{std::vector<float>(static_cast<std::size_t>(grid.voxel_count())), 0};
    const std::vector<VoxelTriangle> triangles = in_voxels(mesh, grid);
    const std::vector<std::vector<std::uint32_t>> rows = by_row(triangles, grid.size.y());
    RowFiller filler(grid, fill);
    std::vector<Crossing> crossings;
    for (int row = 0; row < grid.size.y(); ++row) {
        crossings.clear();
        for (const std::uint32_t i : rows[static_cast<std::size_t>(row)]) {
            cross_row(triangles[i], row, grid.size.x(), crossings);
        }
        filler.fill(row, crossings);
    }
    for (float& share : fill.share) share = std::min(share, 1.0F);
    return fill;
}

}  // namespace raylign::detail

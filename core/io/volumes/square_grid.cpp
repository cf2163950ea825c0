#include "core/io/volumes/square_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"
#include "core/io/files/text.h"
#include "raylign/rigid_transform.h"

namespace raylign::detail {
namespace {

constexpr double kSquare = 1e-9;  ///< |cosine| of axes that were squared

/// Largest |cosine| between two axes, and these.
struct Shear {
    double cosine = 0;
    int a = 0, b = 1;
};

Shear shear_of(const Eigen::Matrix3d& axes) {
    Shear worst;
    for (const auto& [a, b] : {std::pair(0, 1), {0, 2}, {1, 2}}) {
        const double cosine = std::abs(axes.col(a).normalized().dot(axes.col(b).normalized()));
        if (cosine > worst.cosine) worst = {cosine, a, b};
    }
    return worst;
}

std::string rounded(double value) { return number_text(std::round(value * 1000) / 1000); }

std::string degrees_text(double cosine) {
    return rounded(std::asin(std::min(1.0, cosine)) * 180 / std::numbers::pi) + " degrees";
}

/// A sheared lattice on a square one.
struct SquareLattice {
    VoxelGrid grid;
    Eigen::Matrix3d from_square = Eigen::Matrix3d::Identity();  ///< voxel of the sheared one = begin + this * voxel
    Eigen::Vector3d begin = Eigen::Vector3d::Zero();
    int slices = 2;  ///< the axis whose planes stay
};

/// Gram and Schmidt's axes of the columns of `lattice`, in the given order; `along` gets their coefficients, so that
/// lattice = axes * along.
Eigen::Matrix3d square_axes(const Eigen::Matrix3d& lattice, const std::array<int, 3>& order, Eigen::Matrix3d& along) {
    Eigen::Matrix3d axes;
    along.setZero();
    for (std::size_t i = 0; i < 3; ++i) {
        Eigen::Vector3d rest = lattice.col(order[i]);
        for (std::size_t j = 0; j < i; ++j) {
            along(order[j], order[i]) = axes.col(order[j]).dot(lattice.col(order[i]));
            rest -= along(order[j], order[i]) * axes.col(order[j]);
        }
        along(order[i], order[i]) = rest.norm();
        axes.col(order[i]) = rest / rest.norm();
    }
    return axes;
}

SquareLattice square_lattice(const VoxelGrid& sheared) {
    const Shear shear = shear_of(sheared.direction);
    SquareLattice square;
    // Of the two axes that are not at right angles, the one of thicker voxels counts the slices.
    square.slices = sheared.spacing_mm[shear.a] > sheared.spacing_mm[shear.b] ? shear.a : shear.b;
    const std::array<int, 3> order = {square.slices == 0 ? 1 : 0, square.slices == 2 ? 1 : 2, square.slices};
    Eigen::Matrix3d along;
    VoxelGrid& grid = square.grid;
    grid.direction = square_axes(sheared.direction * sheared.spacing_mm.asDiagonal(), order, along);
    grid.spacing_mm = along.diagonal();
    square.from_square = inverse_of(along) * along.diagonal().asDiagonal();
    const Eigen::Matrix3d to_square = along.diagonal().cwiseInverse().asDiagonal() * along;
    Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (int corner = 0; corner < 8; ++corner) {  // of what the voxels' interpolant covers in the planes of the slices
        Eigen::Vector3d at;
        for (int axis = 0; axis < 3; ++axis) {
            const int margin = axis == square.slices ? 0 : 1;
            at[axis] = (corner >> axis & 1) != 0 ? sheared.size[axis] - 1 + margin : -margin;
        }
        low = low.cwiseMin(to_square * at);
        high = high.cwiseMax(to_square * at);
    }
    constexpr double kRounding = 1e-3;  // of a voxel: no plane of nothing for the rounding of floats
    Eigen::Vector3d first = (low.array() + kRounding).floor() + 1, end = (high.array() - kRounding).ceil();
    first[square.slices] = 0;
    end[square.slices] = sheared.size[square.slices];
    constexpr double kMostTimes = 100, kFew = 1e6;
    if (!((end - first).prod() < kMostTimes * static_cast<double>(sheared.voxel_count()) + kFew)) {
        throw Error("the voxel axes are too oblique: a square grid around them would have " +
                    number_text((end - first).prod()) + " voxels");
    }
    grid.size = (end - first).cast<int>();
    square.begin = square.from_square * first;
    grid.origin_mm = sheared.ct_from_voxel(square.begin);
    return square;
}

/// Calls visit(index of the voxel, its place in the sheared lattice) for all voxels of the square one.
template <typename Visit>
void for_each_square_voxel(const SquareLattice& square, const Visit& visit) {
    std::size_t index = 0;
    for (int z = 0; z < square.grid.size.z(); ++z) {
        for (int y = 0; y < square.grid.size.y(); ++y) {
            const Eigen::Vector3d row = square.begin + square.from_square.col(1) * y + square.from_square.col(2) * z;
            for (int x = 0; x < square.grid.size.x(); ++x) {
                visit(index++, Eigen::Vector3d(row + square.from_square.col(0) * x));
            }
        }
    }
}

/// The trilinear interpolant padded with zeros.
float interpolated_at(const Volume& volume, const Eigen::Vector3d& at) {
    const Eigen::Vector3d floor = at.array().floor();
    const Eigen::Vector3d upper = at - floor;
    double value = 0;
    for (int corner = 0; corner < 8; ++corner) {
        double weight = 1;
        Eigen::Vector3i voxel;
        for (int axis = 0; axis < 3; ++axis) {
            const bool is_upper = (corner >> axis & 1) != 0;
            weight *= is_upper ? upper[axis] : 1 - upper[axis];
            voxel[axis] = static_cast<int>(floor[axis]) + (is_upper ? 1 : 0);
        }
        const bool is_inside = (voxel.array() >= 0).all() && (voxel.array() < volume.grid.size.array()).all();
        if (weight > 0 && is_inside) value += weight * volume(voxel.x(), voxel.y(), voxel.z());
    }
    return static_cast<float>(value);
}

std::int32_t label_at(const LabelMap& map, const Eigen::Vector3d& at) {
    const Eigen::Vector3i voxel = at.array().round().cast<int>();
    const Eigen::Vector3i& size = map.grid.size;
    if ((voxel.array() < 0).any() || (voxel.array() >= size.array()).any()) return 0;
    const auto row =
        static_cast<std::size_t>(voxel.z()) * static_cast<std::size_t>(size.y()) + static_cast<std::size_t>(voxel.y());
    return map.labels[row * static_cast<std::size_t>(size.x()) + static_cast<std::size_t>(voxel.x())];
}

void note_resampling(const VoxelGrid& sheared, const SquareLattice& square, const std::string& how,
                     std::vector<std::string>& notes) {
    const Shear shear = shear_of(sheared.direction);
    const VoxelGrid& grid = square.grid;
    const auto size_of = [](const auto& v, const auto& text) {
        return text(v[0]) + " x " + text(v[1]) + " x " + text(v[2]);
    };
    notes.push_back("voxel axes " + std::string(1, "xyz"[shear.a]) + " and " + "xyz"[shear.b] + " are " +
                    degrees_text(shear.cosine) + " off a right angle (tilted gantry): resampled to a square grid of " +
                    size_of(grid.size, [](int n) { return std::to_string(n); }) + " voxels of " +
                    size_of(grid.spacing_mm, rounded) + " mm, " + how + " within the planes of axis " +
                    "xyz"[square.slices] + "; beyond the file's voxels is nothing");
}

}  // namespace

void check_and_square(VoxelGrid& grid, const std::string& where, std::vector<std::string>& notes) {
    for (int axis = 0; axis < 3; ++axis) {
        if (grid.spacing_mm[axis] > 0 && std::isfinite(grid.spacing_mm[axis])) continue;
        throw bad_value("voxel spacing along " + std::string(1, "xyz"[axis]),
                        number_text(grid.spacing_mm[axis]) + " mm", "positive", where);
    }
    if (!grid.origin_mm.allFinite()) throw bad_value("origin", "not finite", "finite", where);
    constexpr double kExact = 1e-4, kTolerance = 1e-3;  // as for poses; text headers and floats carry few digits
    constexpr double kLargestCosine = 0.7072;           // 45 degrees
    for (int axis = 0; axis < 3; ++axis) {
        const double length = grid.direction.col(axis).norm();
        if (std::abs(length - 1) <= kTolerance) continue;
        throw bad_value("length of the direction of axis " + std::string(1, "xyz"[axis]), number_text(length),
                        "1 (scaled axes: write the scale as spacing)", where);
    }
    const Shear shear = shear_of(grid.direction);
    if (shear.cosine > kLargestCosine) {
        throw bad_value("shear of the voxel axes " + std::string(1, "xyz"[shear.a]) + " and " + "xyz"[shear.b],
                        degrees_text(shear.cosine), "at most 45 degrees", where);
    }
    constexpr double kLeastVolume = 0.3;  // of unit axes: three may lie nearly in a plane, two by two at 45 degrees
    if (std::abs(determinant_of(grid.direction)) < kLeastVolume) throw Error(where + ": its voxel axes lie in a plane");
    if (shear.cosine > kTolerance) return;
    const Eigen::Matrix3d gram = grid.direction.transpose() * grid.direction;
    const double departure = (gram - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    const Eigen::Matrix3d before = grid.direction;
    const double sign = determinant_of(grid.direction) < 0 ? -1 : 1;  // a mirror times a rotation stays one
    grid.direction = sign * nearest_rotation(sign * grid.direction);
    if (departure <= kExact) return;
    const Eigen::Vector3d farthest_mm = grid.spacing_mm.cwiseProduct(grid.size.cast<double>());
    const double moved_mm = ((grid.direction - before).cwiseAbs() * farthest_mm).norm();
    notes.push_back("the voxel axes are not quite at right angles or of unit length (by " + number_text(departure) +
                    "): squared, which moves no voxel by more than " + rounded(moved_mm) + " mm");
}

VoxelGrid square_grid(const VoxelGrid& grid) {
    return shear_of(grid.direction).cosine <= kSquare ? grid : square_lattice(grid).grid;
}

void on_square_grid(Volume& volume, std::vector<std::string>& notes) {
    if (shear_of(volume.grid.direction).cosine <= kSquare) return;
    const SquareLattice square = square_lattice(volume.grid);
    Volume resampled{square.grid, std::vector<float>(static_cast<std::size_t>(square.grid.voxel_count()))};
    for_each_square_voxel(square, [&](std::size_t index, const Eigen::Vector3d& at) {
        resampled.attenuation_per_mm[index] = interpolated_at(volume, at);
    });
    note_resampling(volume.grid, square, "linearly", notes);
    volume = std::move(resampled);
}

void on_square_grid(LabelMap& map, std::vector<std::string>& notes) {
    if (shear_of(map.grid.direction).cosine <= kSquare) return;
    const SquareLattice square = square_lattice(map.grid);
    LabelMap resampled{square.grid, std::vector<std::int32_t>(static_cast<std::size_t>(square.grid.voxel_count()))};
    for_each_square_voxel(
        square, [&](std::size_t index, const Eigen::Vector3d& at) { resampled.labels[index] = label_at(map, at); });
    note_resampling(map.grid, square, "by the nearest label", notes);
    map = std::move(resampled);
}

}  // namespace raylign::detail

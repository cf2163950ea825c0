#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "raylign/phantom.h"

namespace raylign {
using namespace detail;
namespace {

// 4096 points a cell: quantised to 0.02 %, below what float voxels are compared at.
constexpr int kMaxSamplesPerAxis = 16;

/// How a cell lies to a solid. `crossed` is also returned where the quick test cannot tell.
enum class Side { outside, crossed, inside };

/// A cell's size seen by a solid. `from_cell` maps cell coordinates, [-1/2, 1/2] per axis, to the solid's axes in mm.
struct CellShape {
    Eigen::Matrix3d from_cell;

    [[nodiscard]] Eigen::Vector3d half_extent_mm() const { return from_cell.cwiseAbs().rowwise().sum() / 2; }

    /// Largest norm of scale * (corner - centre) over the eight corners.
    [[nodiscard]] double radius(const Eigen::Vector3d& scale) const {
        double largest = 0;
        for (int corner = 0; corner < 4; ++corner) {  // the other four are their mirror images
            const Eigen::Vector3d c(0.5, corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5);
            largest = std::max(largest, scale.cwiseProduct(from_cell * c).norm());
        }
        return largest;
    }
};

Side side_of_ball(double distance, double radius) {
    if (distance - radius >= 1) return Side::outside;
    return distance + radius < 1 ? Side::inside : Side::crossed;
}

Side side_of_slabs(const Eigen::Vector3d& distance, const Eigen::Vector3d& extent, const Eigen::Vector3d& half) {
    if (((distance - extent).array() >= half.array()).any()) return Side::outside;
    return ((distance + extent).array() < half.array()).all() ? Side::inside : Side::crossed;
}

// One probe per kind of solid: bounds(m) = half extent of m * solid for a linear map m; contains(p) for a point in the
// solid's axes; side(p) of a cell around p.
struct BoxProbe {
    BoxProbe(const Box& solid, const CellShape& cell) : half(solid.half_size_mm), extent(cell.half_extent_mm()) {}
    Eigen::Vector3d half, extent;

    Eigen::Vector3d bounds(const Eigen::Matrix3d& m) const { return m.cwiseAbs() * half; }
    bool contains(const Eigen::Vector3d& p) const { return (p.array().abs() < half.array()).all(); }
    Side side(const Eigen::Vector3d& p) const { return side_of_slabs(p.cwiseAbs(), extent, half); }
};

struct EllipsoidProbe {
    EllipsoidProbe(const Ellipsoid& solid, const CellShape& cell)
        : radii(solid.radii_mm), scale(solid.radii_mm.cwiseInverse()), cell_radius(cell.radius(scale)) {}
    Eigen::Vector3d radii, scale;
    double cell_radius;

    Eigen::Vector3d bounds(const Eigen::Matrix3d& m) const { return (m * radii.asDiagonal()).rowwise().norm(); }
    bool contains(const Eigen::Vector3d& p) const { return p.cwiseProduct(scale).squaredNorm() < 1; }
    Side side(const Eigen::Vector3d& p) const { return side_of_ball(p.cwiseProduct(scale).norm(), cell_radius); }
};

struct CylinderProbe {
    CylinderProbe(const EllipticCylinder& solid, const CellShape& cell)
        : radii(solid.radii_mm.x(), solid.radii_mm.y(), 0),
          scale(1 / radii.x(), 1 / radii.y(), 0),
          half_length(solid.half_length_mm),
          cell_radius(cell.radius(scale)),
          cell_extent_z(cell.half_extent_mm().z()) {}
    Eigen::Vector3d radii, scale;
    double half_length, cell_radius, cell_extent_z;

    Eigen::Vector3d bounds(const Eigen::Matrix3d& m) const {
        return (m * radii.asDiagonal()).rowwise().norm() + m.col(2).cwiseAbs() * half_length;
    }
    bool contains(const Eigen::Vector3d& p) const {
        return p.cwiseProduct(scale).squaredNorm() < 1 && std::abs(p.z()) < half_length;
    }
    Side side(const Eigen::Vector3d& p) const {
        const double height = std::abs(p.z());
        if (height - cell_extent_z >= half_length) return Side::outside;
        const Side round = side_of_ball(p.cwiseProduct(scale).norm(), cell_radius);
        if (round == Side::inside && height + cell_extent_z >= half_length) return Side::crossed;
        return round;
    }
};

BoxProbe make_probe(const Box& solid, const CellShape& cell) { return {solid, cell}; }
EllipsoidProbe make_probe(const Ellipsoid& solid, const CellShape& cell) { return {solid, cell}; }
CylinderProbe make_probe(const EllipticCylinder& solid, const CellShape& cell) { return {solid, cell}; }

/// Centres of the samples relative to their cell's, in the solid's axes [mm].
std::vector<Eigen::Vector3d> sample_offsets_mm(const CellShape& cell, int samples_per_axis) {
    std::vector<Eigen::Vector3d> offsets;
    const auto centre = [&](int i) { return (i + 0.5) / samples_per_axis - 0.5; };
    for (int z = 0; z < samples_per_axis; ++z) {
        for (int y = 0; y < samples_per_axis; ++y) {
            for (int x = 0; x < samples_per_axis; ++x) {
                offsets.push_back(cell.from_cell * Eigen::Vector3d(centre(x), centre(y), centre(z)));
            }
        }
    }
    return offsets;
}

/// Share of a cell's samples that lie in the solid.
template <class Probe>
double coverage(const Probe& probe, const Eigen::Vector3d& p, const std::vector<Eigen::Vector3d>& offsets) {
    const Side side = probe.side(p);
    if (side != Side::crossed) return side == Side::inside ? 1 : 0;
    int hits = 0;
    for (const Eigen::Vector3d& offset : offsets) hits += probe.contains(p + offset);
    return static_cast<double>(hits) / static_cast<double>(offsets.size());
}

template <class AnySolid>
void add_solid(Volume& volume, const AnySolid& solid, int samples_per_axis) {
    const VoxelGrid& grid = volume.grid;
    const RigidTransform solid_from_ct = inverse(solid.ct_from_solid);
    const Eigen::Matrix3d solid_from_voxel = solid_from_ct.rotation * grid.direction * grid.spacing_mm.asDiagonal();
    const Eigen::Matrix3d voxel_from_solid =
        grid.spacing_mm.cwiseInverse().asDiagonal() * grid.direction.transpose() * solid.ct_from_solid.rotation;
    const auto probe = make_probe(solid, CellShape{solid_from_voxel});
    const auto offsets = sample_offsets_mm({solid_from_voxel}, samples_per_axis);

    // Cells whose centre is within half a voxel of the solid's bounding box; a whole one, for rounding.
    const Eigen::Vector3d centre = grid.voxel_from_ct(solid.ct_from_solid.translation_mm);
    const Eigen::Vector3d reach = probe.bounds(voxel_from_solid) + Eigen::Vector3d::Ones();
    const Eigen::Vector3d last = (grid.size - Eigen::Vector3i::Ones()).template cast<double>();
    const auto begin =
        (centre - reach).array().ceil().max(0).min(last.array() + 1).matrix().template cast<int>().eval();
    const auto end = (centre + reach).array().floor().max(-1).min(last.array()).matrix().template cast<int>().eval();
    for (int z = begin.z(); z <= end.z(); ++z) {
        for (int y = begin.y(); y <= end.y(); ++y) {
            for (int x = begin.x(); x <= end.x(); ++x) {
                const Eigen::Vector3d p = solid_from_ct * grid.ct_from_voxel(Eigen::Vector3d(x, y, z));
                const double share = coverage(probe, p, offsets);
                if (share == 0) continue;
                float& voxel = volume.attenuation_per_mm[volume.index(x, y, z)];
                voxel = static_cast<float>(voxel + share * solid.attenuation_per_mm);
            }
        }
    }
}

}  // namespace

Volume voxelise(const Phantom& phantom, const VoxelGrid& grid, int samples_per_axis) {
    if (samples_per_axis < 1 || samples_per_axis > kMaxSamplesPerAxis) {
        throw bad_value("samples_per_axis", std::to_string(samples_per_axis),
                        "in [1, " + std::to_string(kMaxSamplesPerAxis) + "]", "voxelise");
    }
    if (grid.size.minCoeff() < 1 || !(grid.spacing_mm.minCoeff() > 0)) {
        throw Error("voxelise: the grid must have at least 1 voxel per axis and a positive spacing");
    }
    Volume volume{grid, std::vector<float>(static_cast<std::size_t>(grid.voxel_count()))};
    for (const Solid& solid : phantom.solids) {
        std::visit([&](const auto& s) { add_solid(volume, s, samples_per_axis); }, solid);
    }
    return volume;
}

}  // namespace raylign

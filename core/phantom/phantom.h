#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "core/geometry/camera.h"
#include "core/geometry/grid.h"
#include "core/image/image.h"
#include "core/image/volume.h"

namespace raylign {

/// Solids in ct coordinates [mm]; `ct_from_solid` places them. Attenuations of overlapping solids ADD (soft tissue plus the
/// extra of bone), so that the line integral of a phantom is the sum over its solids, exactly.
struct Box {
    RigidTransform ct_from_solid;
    Eigen::Vector3d half_size_mm;
    double attenuation_per_mm;
};
struct Ellipsoid {
    RigidTransform ct_from_solid;
    Eigen::Vector3d radii_mm;
    double attenuation_per_mm;
};
struct EllipticCylinder {  ///< axis along the solid's z
    RigidTransform ct_from_solid;
    Eigen::Vector2d radii_mm;
    double half_length_mm;
    double attenuation_per_mm;
};
using Solid = std::variant<Box, Ellipsoid, EllipticCylinder>;

struct Phantom {
    std::string name;
    std::vector<Solid> solids;
};

/// Length of the chord that a line cuts from a solid [mm]; the line passes `point_ct` with unit direction `direction_ct`,
/// restricted to points in front of `point_ct` (a ray).
[[nodiscard]] double chord_mm(const Solid& solid, const Eigen::Vector3d& point_ct, const Eigen::Vector3d& direction_ct);

/// Exact line integral along a ray: sum of attenuation times chord.
[[nodiscard]] double exact_line_integral(const Phantom& phantom, const Eigen::Vector3d& source_ct,
                                         const Eigen::Vector3d& direction_ct);

/// Exact DRR: one exact line integral per pixel centre.
[[nodiscard]] Image exact_drr(const Phantom& phantom, const ViewGeometry& view, const RigidTransform& world_from_ct);

/// The voxelised twin: each voxel is the mean over `samples_per_axis`^3 points spread over its cell.
[[nodiscard]] Volume voxelise(const Phantom& phantom, const VoxelGrid& grid, int samples_per_axis = 4);

/// A grid of the given size and spacing, identity direction, centred on the ct origin.
[[nodiscard]] VoxelGrid centred_grid(const Eigen::Vector3i& size, const Eigen::Vector3d& spacing_mm);

[[nodiscard]] Phantom box_phantom(const Eigen::Vector3d& extent_mm);
[[nodiscard]] Phantom ellipsoid_phantom(const Eigen::Vector3d& extent_mm);
/// Thoracolumbar spine: vertebrae with bodies, pedicles, arches, transverse and spinous processes, discs between them, ribs
/// and soft tissue; slightly curved and asymmetric, so that no two poses look alike. Fills `extent_mm`.
[[nodiscard]] Phantom spine_phantom(const Eigen::Vector3d& extent_mm);

}  // namespace raylign

#pragma once

#include <Eigen/Core>
#include <string>
#include <variant>
#include <vector>

#include "raylign/camera.h"
#include "raylign/grid.h"
#include "raylign/image.h"
#include "raylign/volume.h"

namespace raylign {

/// Solids in ct coordinates [mm]; `ct_from_solid` places them. Attenuations of overlapping solids ADD (soft tissue plus
/// the extra of bone), so that the line integral of a phantom is the sum over its solids, exactly. A negative
/// attenuation hollows a solid out (cancellous bone inside a cortical shell). Solids are open sets: a line within a
/// face cuts no chord.
struct Box {
    RigidTransform ct_from_solid;
    Eigen::Vector3d half_size_mm;
    double attenuation_per_mm;
};
/// As a Box.
struct Ellipsoid {
    RigidTransform ct_from_solid;
    Eigen::Vector3d radii_mm;
    double attenuation_per_mm;
};
struct EllipticCylinder {  ///< axis along the solid's z, flat caps
    RigidTransform ct_from_solid;
    Eigen::Vector2d radii_mm;
    double half_length_mm;
    double attenuation_per_mm;
};
/// What phantoms are made of.
using Solid = std::variant<Box, Ellipsoid, EllipticCylinder>;

/// A sum of solids, in ct coordinates.
struct Phantom {
    std::string name;
    std::vector<Solid> solids;
};

/// Length of the chord that a line cuts from a solid [mm]; the line passes `point_ct` with unit direction
/// `direction_ct`, restricted to points in front of `point_ct` (a ray). Error about 1e-16 times the distance from
/// `point_ct` to the solid, away from grazing lines.
[[nodiscard]] double chord_mm(const Solid& solid, const Eigen::Vector3d& point_ct, const Eigen::Vector3d& direction_ct);

/// Volume of a solid [mm^3].
[[nodiscard]] double volume_mm3(const Solid& solid);

/// Exact integral of the attenuation over all space [mm^2]: sum of attenuation times volume. What a voxelised twin that
/// covers the phantom must add up to.
[[nodiscard]] double exact_mass_mm2(const Phantom& phantom);

/// Exact line integral along a ray: sum of attenuation times chord.
[[nodiscard]] double exact_line_integral(const Phantom& phantom, const Eigen::Vector3d& source_ct,
                                         const Eigen::Vector3d& direction_ct);

/// Exact DRR: one exact line integral per pixel centre. Rays run from the source without end: the detector cuts nothing
/// off.
[[nodiscard]] Image exact_drr(const Phantom& phantom, const ViewGeometry& view, const RigidTransform& world_from_ct);

/// The voxelised twin: each voxel is the mean over `samples_per_axis`^3 points spread evenly over its cell. One thread:
/// only cells that a surface may cross are sampled. Throws Error for an empty grid or samples_per_axis outside [1, 16].
[[nodiscard]] Volume voxelise(const Phantom& phantom, const VoxelGrid& grid, int samples_per_axis = 4);

/// A grid of the given size and spacing, identity direction, centred on the ct origin.
[[nodiscard]] VoxelGrid centred_grid(const Eigen::Vector3i& size, const Eigen::Vector3d& spacing_mm);

/// One box (ellipsoid) of water-like attenuation, 0.02 / mm, centred on the ct origin. It fills the middle half of
/// `extent_mm`: its sides (axes) are 1/2, 0.45 and 0.4 of the extent's x, y and z, so that no two poses look alike.
/// Throws Error for an extent that is not positive and finite; so does spine_phantom.
[[nodiscard]] Phantom box_phantom(const Eigen::Vector3d& extent_mm);
[[nodiscard]] Phantom ellipsoid_phantom(const Eigen::Vector3d& extent_mm);

/// Thoracolumbar spine: vertebrae with bodies, pedicles, arches, transverse and spinous processes, discs between them,
/// ribs and soft tissue; slightly curved and asymmetric, so that no two poses look alike. Fills `extent_mm`. Natural
/// size (5 vertebrae, 40 mm apart, in 200 mm) where the extent is at least 200 x 200 mm across; else the bones shrink
/// with it. The number of vertebrae follows from the height. ct axes are LPS: x left, y posterior, z head.
/// Attenuations as at about 70 keV: soft tissue 0.0193 / mm, cancellous bone 0.008 and cortical bone 0.02 above it.
[[nodiscard]] Phantom spine_phantom(const Eigen::Vector3d& extent_mm);

/// One vertebra of that spine, exactly what it adds to the soft tissue; 0 is the lowest. Throws Error for a level that
/// the extent has no room for.
[[nodiscard]] Phantom spine_vertebra(const Eigen::Vector3d& extent_mm, int level);

}  // namespace raylign

#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "raylign/camera.h"
#include "raylign/grid.h"
#include "raylign/rigid_transform.h"

namespace raylign::detail {

/// All rays of one view under one pose, in voxel coordinates: everything that a backend knows of geometry.
/// The ray of pixel (u, v) is
///   y(depth) = source_voxel + depth * (direction_voxel + u * step_u_voxel + v * step_v_voxel),
/// where depth [mm] runs along the camera's z axis from 0 (source) to `depth_max_mm` (detector). The length of a ray
/// per unit of depth is |spacing_mm .* direction(u, v)| (the direction matrix is orthonormal).
struct RayFrame {
    Eigen::Vector3d source_voxel;
    Eigen::Vector3d direction_voxel;  ///< of pixel (0, 0), per mm of depth
    Eigen::Vector3d step_u_voxel;
    Eigen::Vector3d step_v_voxel;
    double depth_max_mm;                                       ///< infinite where the camera has no sdd
    double ceiling = std::numeric_limits<double>::infinity();  ///< of what is shown of line integrals: see saturated()
    std::uint32_t view;
    std::uint32_t pose;

    [[nodiscard]] Eigen::Vector3d ray_voxel(double u, double v) const {
        return direction_voxel + u * step_u_voxel + v * step_v_voxel;
    }
};
static_assert(sizeof(RayFrame) == 120, "RayFrame travels to devices as is");

/// What a detector shows of a line integral I that never lets less than the share f = exp(-ceiling) of the open beam
/// through (scatter, glare, the camera's black): -log(f + (1 - f) exp(-I)), and by how much that grows with I.
struct Saturated {
    float line_integral, slope;
};

/// With a = min(I, ceiling) and b the other one, a - log(1 + exp(a - b) - exp(-b)): nothing overflows, 0 stays 0, an
/// infinite ceiling changes nothing and a far one no bit.
[[nodiscard]] inline Saturated saturated(float line_integral, float ceiling) {
    const float a = std::min(line_integral, ceiling), b = std::max(line_integral, ceiling);
    const float none = std::exp(-b), rest = std::exp(a - b) - none;
    return {a - std::log1p(rest), ((line_integral < ceiling ? 1 : std::exp(a - b)) - none) / (1 + rest)};
}

[[nodiscard]] RayFrame make_ray_frame(const VoxelGrid& grid, const ViewGeometry& view,
                                      const RigidTransform& world_from_ct);

/// One frame per (pose, view), pose-major: frames[pose * views.size() + view].
[[nodiscard]] std::vector<RayFrame> make_ray_frames(const VoxelGrid& grid, std::span<const ViewGeometry> views,
                                                    std::span<const RigidTransform> world_from_ct);

/// Derivative of a RayFrame's vectors with respect to one pose parameter [voxels per rad or per mm].
struct RayFrameDerivative {
    Eigen::Vector3d source_voxel;
    Eigen::Vector3d direction_voxel;
    Eigen::Vector3d step_u_voxel;
    Eigen::Vector3d step_v_voxel;

    [[nodiscard]] Eigen::Vector3d ray_voxel(double u, double v) const {
        return direction_voxel + u * step_u_voxel + v * step_v_voxel;
    }
};
/// With respect to the twist (w, v) at zero, applied about `centre_world_mm`: a world point x stays where it is while
/// the volume moves, so in ct it moves by -R^T (v + w x (x - c)) and a direction d by -R^T (w x d), R = rotation of
/// world_from_ct.
using RayFrameDerivatives = std::array<RayFrameDerivative, 6>;
[[nodiscard]] RayFrameDerivatives make_ray_frame_derivatives(const VoxelGrid& grid, const ViewGeometry& view,
                                                             const RigidTransform& world_from_ct,
                                                             const Eigen::Vector3d& centre_world_mm);

}  // namespace raylign::detail

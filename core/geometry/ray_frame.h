#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>
#include <span>

#include "core/geometry/camera.h"
#include "core/geometry/grid.h"
#include "core/geometry/rigid_transform.h"

namespace raylign {

/// All rays of one view under one pose, in voxel coordinates: everything that an engine knows of geometry.
/// The ray of pixel (u, v) is y(depth) = source_voxel + depth * (direction_voxel + u * step_u_voxel + v * step_v_voxel),
/// where depth [mm] runs along the camera's z axis from 0 (source) to `depth_max_mm` (detector).
/// The length of a ray per unit of depth is |spacing_mm .* direction(u, v)| (the direction matrix is orthonormal).
struct RayFrame {
    Eigen::Vector3d source_voxel;
    Eigen::Vector3d direction_voxel;  ///< of pixel (0, 0), per mm of depth
    Eigen::Vector3d step_u_voxel;
    Eigen::Vector3d step_v_voxel;
    double depth_max_mm;  ///< infinite where the camera has no sdd
    std::uint32_t view;
    std::uint32_t pose;

    [[nodiscard]] Eigen::Vector3d ray_voxel(double u, double v) const {
        return direction_voxel + u * step_u_voxel + v * step_v_voxel;
    }
};
static_assert(sizeof(RayFrame) == 112, "RayFrame travels to devices as is");

[[nodiscard]] RayFrame make_ray_frame(const VoxelGrid& grid, const ViewGeometry& view,
                                      const RigidTransform& world_from_ct);

/// One frame per (pose, view), pose-major: frames[pose * views.size() + view].
[[nodiscard]] std::vector<RayFrame> make_ray_frames(const VoxelGrid& grid, std::span<const ViewGeometry> views,
                                                    std::span<const RigidTransform> world_from_ct);

}  // namespace raylign

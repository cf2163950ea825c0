#include "core/geometry/ray_frame.h"

#include <Eigen/Geometry>
#include <limits>

#include "core/base/linear_algebra.h"

namespace raylign::detail {

RayFrame make_ray_frame(const VoxelGrid& grid, const ViewGeometry& view, const RigidTransform& world_from_ct) {
    const RigidTransform ct_from_camera = inverse(view.camera_from_world * world_from_ct);
    const Eigen::Matrix3d voxel_from_ct = grid.spacing_mm.cwiseInverse().asDiagonal() * grid.direction.transpose();
    const Eigen::Matrix3d voxel_from_pixel =
        voxel_from_ct * ct_from_camera.rotation * inverse_of(view.camera.intrinsics_px);
    return {.source_voxel = grid.voxel_from_ct(ct_from_camera.translation_mm),
            .direction_voxel = voxel_from_pixel.col(2),
            .step_u_voxel = voxel_from_pixel.col(0),
            .step_v_voxel = voxel_from_pixel.col(1),
            .depth_max_mm = view.camera.sdd_mm.value_or(std::numeric_limits<double>::infinity()),
            .view = 0,
            .pose = 0};
}

std::vector<RayFrame> make_ray_frames(const VoxelGrid& grid, std::span<const ViewGeometry> views,
                                      std::span<const RigidTransform> world_from_ct) {
    std::vector<RayFrame> frames;
    frames.reserve(views.size() * world_from_ct.size());
    for (std::size_t pose = 0; pose < world_from_ct.size(); ++pose) {
        for (std::size_t view = 0; view < views.size(); ++view) {
            frames.push_back(make_ray_frame(grid, views[view], world_from_ct[pose]));
            frames.back().view = static_cast<std::uint32_t>(view);
            frames.back().pose = static_cast<std::uint32_t>(pose);
        }
    }
    return frames;
}

RayFrameDerivatives make_ray_frame_derivatives(const VoxelGrid& grid, const ViewGeometry& view,
                                               const RigidTransform& world_from_ct,
                                               const Eigen::Vector3d& centre_world_mm) {
    const Eigen::Matrix3d voxel_from_world =
        grid.spacing_mm.cwiseInverse().asDiagonal() * grid.direction.transpose() * world_from_ct.rotation.transpose();
    const RigidTransform world_from_camera = inverse(view.camera_from_world);
    const Eigen::Matrix3d world_from_pixel = world_from_camera.rotation * inverse_of(view.camera.intrinsics_px);
    const Eigen::Vector3d arm_mm = world_from_camera.translation_mm - centre_world_mm;
    RayFrameDerivatives derivatives;
    for (int i = 0; i < 3; ++i) {
        const Eigen::Vector3d axis = Eigen::Vector3d::Unit(i);
        derivatives[i] = {-voxel_from_world * axis.cross(arm_mm),
                          -voxel_from_world * axis.cross(world_from_pixel.col(2)),
                          -voxel_from_world * axis.cross(world_from_pixel.col(0)),
                          -voxel_from_world * axis.cross(world_from_pixel.col(1))};
        derivatives[3 + i] = {-voxel_from_world * axis, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                              Eigen::Vector3d::Zero()};
    }
    return derivatives;
}

}  // namespace raylign::detail

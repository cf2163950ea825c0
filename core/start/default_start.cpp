#include "raylign/start.h"

#include <limits>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"

namespace raylign {
using namespace detail;
namespace {

/// argmin over x of sum |P_i (x - s_i)|^2, P_i = 1 - d_i d_i^T: normal equations (sum P_i) x = sum P_i s_i, solved in
/// the eigenbasis so that directions which no view determines get 0 (the solution nearest to the origin).
Eigen::Vector3d nearest_to_central_rays(std::span<const View> views) {
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const View& view : views) {
        const Eigen::Vector2d middle = (view.geometry.camera.size_px.cast<double>() - Eigen::Vector2d::Ones()) / 2;
        const Eigen::Vector3d direction = ray_direction_world(view.geometry, middle);
        const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - direction * direction.transpose();
        matrix += across;
        right += across * source_world_mm(view.geometry);
    }
    const PrincipalAxes principal = principal_axes(matrix);
    // Rays less than about 2 degrees apart do not fix the depth: sin^2(2 deg) = 1e-3.
    const double smallest = 1e-3 * static_cast<double>(views.size());
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    for (int i = 0; i < 3; ++i) {
        if (principal.values[i] < smallest) continue;
        const Eigen::Vector3d axis = principal.axes.col(i);
        point += axis * (axis.dot(right) / principal.values[i]);
    }
    return point;
}

}  // namespace

RigidTransform default_start(const VoxelGrid& grid, std::span<const View> views) {
    const Eigen::Vector3d point_world = nearest_to_central_rays(views);
    for (const View& view : views) {
        const double depth_mm = (view.geometry.camera_from_world * point_world).z();
        const double sdd_mm = view.geometry.camera.sdd_mm.value_or(std::numeric_limits<double>::infinity());
        if (!(depth_mm > 0.1 * sdd_mm || (std::isinf(sdd_mm) && depth_mm > 1)) || !(depth_mm < sdd_mm)) {
            throw Error("view " + view.name + ": the views do not say where the patient is: give --start");
        }
    }
    return RigidTransform::translate(point_world - grid.centre_ct_mm());
}

}  // namespace raylign

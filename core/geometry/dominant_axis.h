#pragma once

#include <Eigen/Core>
#include <cmath>

namespace raylign::detail {

/// A later axis must be longer by this share to win. It moves the border between two axes off the places where
/// symmetric scenes put whole pixel columns (45-degree views), so that rounding in float backends cannot flip a ray.
inline constexpr double kAxisBias = 1e-5;

/// The index axis along which a Joseph ray steps: the largest |component| of its direction in voxels, axis 0 before 1
/// before 2 within the bias above. Chosen per ray, so that a pose change moves the border across the image, one ray at
/// a time.
[[nodiscard]] inline int dominant_axis(const Eigen::Vector3d& ray_voxel) {
    const Eigen::Vector3d length = ray_voxel.cwiseAbs();
    int axis = length.y() > length.x() * (1 + kAxisBias) ? 1 : 0;
    if (length.z() > length[axis] * (1 + kAxisBias)) axis = 2;
    return axis;
}

}  // namespace raylign::detail

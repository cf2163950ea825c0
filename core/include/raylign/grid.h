#pragma once

#include <Eigen/Core>

namespace raylign {

/// Where the voxels of a volume lie in patient coordinates (ct frame: LPS, mm). Integer coordinates are voxel centres:
/// x_ct = origin_mm + direction * (spacing_mm .* voxel).
struct VoxelGrid {
    Eigen::Vector3i size = Eigen::Vector3i::Zero();           ///< voxels along x (fastest), y, z
    Eigen::Vector3d spacing_mm = Eigen::Vector3d::Ones();     ///< positive
    Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();      ///< centre of voxel (0, 0, 0)
    Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();  ///< columns: unit axes, orthonormal, may mirror

    [[nodiscard]] Eigen::Vector3d ct_from_voxel(const Eigen::Vector3d& voxel) const {
        return origin_mm + direction * spacing_mm.cwiseProduct(voxel);
    }
    [[nodiscard]] Eigen::Vector3d voxel_from_ct(const Eigen::Vector3d& x_ct) const {
        return (direction.transpose() * (x_ct - origin_mm)).cwiseQuotient(spacing_mm);
    }
    /// Centre of the grid in ct [mm].
    [[nodiscard]] Eigen::Vector3d centre_ct_mm() const {
        return ct_from_voxel((size.cast<double>() - Eigen::Vector3d::Ones()) / 2);
    }
    [[nodiscard]] long long voxel_count() const { return static_cast<long long>(size.x()) * size.y() * size.z(); }
};

/// Voxels with begin <= voxel < end on every axis.
struct VoxelBox {
    Eigen::Vector3i begin = Eigen::Vector3i::Zero(), end = Eigen::Vector3i::Zero();
};

/// A box with sides along the axes of ct coordinates; points on its faces are inside.
struct CtBox {
    Eigen::Vector3d low_mm = Eigen::Vector3d::Zero(), high_mm = Eigen::Vector3d::Zero();
};

}  // namespace raylign

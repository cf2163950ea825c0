#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/base/for_each.h"
#include "raylign/volume.h"

namespace raylign::detail {

/// What is known of an object before it is registered, from one pass over its voxels v. Positions are voxels.
struct VolumeSums {
    double mass = 0;  ///< sum |v|; not finite where a voxel is not
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    double attenuating = 0, attenuating_count = 0;  ///< voxels above 0: their sum and number
    /// Cubes of `cell` voxels a side (those at the ends may be smaller), x fastest: the sum of voxels above 0 in each.
    int cell = 1;
    Eigen::Vector3i cells = Eigen::Vector3i::Zero();
    std::vector<double> of_cells;
};
/// At most kCellsAlong cells along the longest axis.
[[nodiscard]] VolumeSums volume_sums(const Volume& volume, const ForEach& for_each = in_order);
inline constexpr int kCellsAlong = 12;

}  // namespace raylign::detail

#include "core/image/composed.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace raylign::detail {
namespace {

/// The field at voxel coordinates: the trilinear interpolant of the lattice padded with zeros.
float field_at(const Volume& volume, const Eigen::Vector3d& voxel) {
    const Eigen::Vector3i& size = volume.grid.size;
    const Eigen::Vector3d low = voxel.array().floor();
    const Eigen::Vector3d part = voxel - low;
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3i step(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
        const Eigen::Vector3i at = low.cast<int>() + step;
        if (at.minCoeff() < 0 || (size - at).minCoeff() <= 0) continue;
        double share = 1;
        for (int axis = 0; axis < 3; ++axis) share *= step[axis] == 1 ? part[axis] : 1 - part[axis];
        sum += share * volume(at.x(), at.y(), at.z());
    }
    return static_cast<float>(sum);
}

}  // namespace

PosedMap posed_map(const VoxelGrid& to, const RigidTransform& to_world_from_ct, const VoxelGrid& from,
                   const RigidTransform& from_world_from_ct) {
    const RigidTransform to_ct_from_ct = inverse(to_world_from_ct) * from_world_from_ct;
    const auto mapped = [&](const Eigen::Vector3d& voxel) {
        return to.voxel_from_ct(to_ct_from_ct * from.ct_from_voxel(voxel));
    };
    PosedMap map{Eigen::Matrix3d::Zero(), mapped(Eigen::Vector3d::Zero())};
    for (int axis = 0; axis < 3; ++axis) map.matrix.col(axis) = mapped(Eigen::Vector3d::Unit(axis)) - map.offset;
    return map;
}

VoxelBox reached_voxels(const Eigen::Vector3i& size, const PosedMap& map, const Eigen::Vector3i& other_size) {
    Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::max()), high = -low;
    for (int corner = 0; corner < 8; ++corner) {
        Eigen::Vector3d at = -Eigen::Vector3d::Ones();
        for (int axis = 0; axis < 3; ++axis) at[axis] += (corner >> axis & 1) * (other_size[axis] + 1);
        low = low.cwiseMin(map(at));
        high = high.cwiseMax(map(at));
    }
    VoxelBox box;
    for (int axis = 0; axis < 3; ++axis) {
        const double most = size[axis];
        box.begin[axis] = static_cast<int>(std::clamp(std::ceil(low[axis]), 0.0, most));
        box.end[axis] = static_cast<int>(std::clamp(std::floor(high[axis]) + 1, 0.0, most));
    }
    return box;
}

void add_resampled(Volume& onto, const RigidTransform& onto_world_from_ct, const Volume& other,
                   const RigidTransform& other_world_from_ct) {
    const PosedMap there = posed_map(other.grid, other_world_from_ct, onto.grid, onto_world_from_ct);
    const PosedMap back = posed_map(onto.grid, onto_world_from_ct, other.grid, other_world_from_ct);
    const VoxelBox box = reached_voxels(onto.grid.size, back, other.grid.size);
    onto.surface.reset();
    for (int z = box.begin.z(); z < box.end.z(); ++z) {
        for (int y = box.begin.y(); y < box.end.y(); ++y) {
            for (int x = box.begin.x(); x < box.end.x(); ++x) {
                onto.attenuation_per_mm[onto.index(x, y, z)] += field_at(other, there(Eigen::Vector3d(x, y, z)));
            }
        }
    }
}

}  // namespace raylign::detail

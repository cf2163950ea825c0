#include "core/registration/scene/collisions.h"

#include <algorithm>
#include <cmath>

#include "core/image/composed.h"

namespace raylign::detail {
namespace {

bool attenuates(const Volume& volume, const Eigen::Vector3d& voxel) {
    const Eigen::Vector3i at(static_cast<int>(std::lround(voxel.x())), static_cast<int>(std::lround(voxel.y())),
                             static_cast<int>(std::lround(voxel.z())));
    if (at.minCoeff() < 0 || (volume.grid.size - at).minCoeff() <= 0) return false;
    return volume(at.x(), at.y(), at.z()) > 0;
}

std::int64_t shared_voxels(const PosedVolume& of, const PosedVolume& other) {
    const VoxelGrid& grid = of.volume->grid;
    const PosedMap there = posed_map(other.volume->grid, other.world_from_ct, grid, of.world_from_ct);
    const PosedMap back = posed_map(grid, of.world_from_ct, other.volume->grid, other.world_from_ct);
    const VoxelBox box = reached_voxels(grid.size, back, other.volume->grid.size);
    std::int64_t count = 0;
    for (int z = box.begin.z(); z < box.end.z(); ++z) {
        for (int y = box.begin.y(); y < box.end.y(); ++y) {
            for (int x = box.begin.x(); x < box.end.x(); ++x) {
                if (!((*of.volume)(x, y, z) > 0)) continue;
                count += attenuates(*other.volume, there(Eigen::Vector3d(x, y, z))) ? 1 : 0;
            }
        }
    }
    return count;
}

double volume_mm3(const Volume& volume) {
    const auto count = std::ranges::count_if(volume.attenuation_per_mm, [](float mu) { return mu > 0; });
    return static_cast<double>(count) * volume.grid.spacing_mm.prod();
}

}  // namespace

std::vector<Collision> collisions(std::span<const PosedVolume> objects) {
    std::vector<double> volumes;
    for (const PosedVolume& object : objects) volumes.push_back(volume_mm3(*object.volume));
    std::vector<Collision> found;
    for (std::size_t a = 0; a < objects.size(); ++a) {
        for (std::size_t b = a + 1; b < objects.size(); ++b) {
            const double voxel_a = objects[a].volume->grid.spacing_mm.prod();
            const double voxel_b = objects[b].volume->grid.spacing_mm.prod();
            const std::size_t finer = voxel_b < voxel_a ? b : a;
            const std::int64_t voxels = shared_voxels(objects[finer], objects[finer == a ? b : a]);
            if (voxels == 0) continue;
            const double shared_mm3 = static_cast<double>(voxels) * std::min(voxel_a, voxel_b);
            const auto [smaller_mm3, larger_mm3] = std::minmax(volumes[a], volumes[b]);
            found.push_back({a, b, voxels, shared_mm3, std::min(1.0, shared_mm3 / smaller_mm3),
                             std::min(1.0, shared_mm3 / larger_mm3)});
        }
    }
    return found;
}

}  // namespace raylign::detail

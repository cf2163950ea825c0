#include "core/registration/object/overlap.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/base/error.h"

namespace raylign::detail {
namespace {

/// None where the view does not show it on a pixel that counts.
std::optional<Eigen::Vector2i> pixel_that_shows(const View& view, const Eigen::Vector3d& point_world_mm) {
    const Eigen::Vector3d in_camera = view.geometry.camera_from_world * point_world_mm;
    if (!(in_camera.z() > 0)) return std::nullopt;
    const Eigen::Vector3d pixel = view.geometry.camera.intrinsics_px * in_camera / in_camera.z();
    const int x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
    const Eigen::Vector2i& size = view.geometry.camera.size_px;
    if (x < 0 || y < 0 || x >= size.x() || y >= size.y()) return std::nullopt;
    if (!view.weights.empty() && !(view.weights(x, y) > 0)) return std::nullopt;
    return Eigen::Vector2i(x, y);
}

}  // namespace

ObjectSample sample_object(const Volume& volume) { return sample_object(volume_sums(volume), volume.grid); }

ObjectSample sample_object(const VolumeSums& volume, const VoxelGrid& grid) {
    const std::vector<double>& sums = volume.of_cells;
    const Eigen::Vector3i& cells = volume.cells;
    if (!(volume.attenuating > 0)) throw Error("volume: no voxel attenuates");
    ObjectSample sample;
    std::size_t i = 0;
    for (int z = 0; z < cells.z(); ++z) {
        for (int y = 0; y < cells.y(); ++y) {
            for (int x = 0; x < cells.x(); ++x, ++i) {
                if (sums[i] == 0) continue;
                const Eigen::Vector3d middle = (Eigen::Vector3d(x, y, z).array() + 0.5) * volume.cell - 0.5;
                sample.points_ct_mm.push_back(
                    grid.ct_from_voxel(middle.cwiseMin((grid.size.array() - 1).cast<double>().matrix())));
                sample.weights.push_back(sums[i] / volume.attenuating);
            }
        }
    }
    return sample;
}

bool is_seen(const View& view, const Eigen::Vector3d& point_world_mm) {
    return pixel_that_shows(view, point_world_mm).has_value();
}

double seen_share(const ObjectSample& sample, const View& view, const RigidTransform& world_from_ct) {
    double share = 0;
    for (std::size_t i = 0; i < sample.weights.size(); ++i) {
        if (is_seen(view, world_from_ct * sample.points_ct_mm[i])) share += sample.weights[i];
    }
    return std::min(1.0, share);
}

double covered_share(const ObjectSample& sample, const View& view, const RigidTransform& world_from_ct) {
    const Eigen::Vector2i& size = view.geometry.camera.size_px;
    Eigen::Vector2i low = size, high = Eigen::Vector2i::Constant(-1);
    for (const Eigen::Vector3d& point_ct_mm : sample.points_ct_mm) {
        const std::optional<Eigen::Vector2i> pixel = pixel_that_shows(view, world_from_ct * point_ct_mm);
        if (!pixel) continue;
        low = low.cwiseMin(*pixel);
        high = high.cwiseMax(*pixel);
    }
    if (high.minCoeff() < 0) return 0;
    const Eigen::Vector2d share = (high - low).cast<double>().cwiseQuotient(size.cast<double>());
    return share.prod();
}

double least_seen_share(const ObjectSample& sample, std::span<const View> views, const RigidTransform& world_from_ct) {
    double least = 1;
    for (const View& view : views) least = std::min(least, seen_share(sample, view, world_from_ct));
    return least;
}

}  // namespace raylign::detail

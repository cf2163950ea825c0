#include "core/evaluation/mismatch.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/error.h"
#include "core/image/smooth.h"

namespace raylign::detail {
namespace {

constexpr int kSubSamples = 4;

double distance_to_segment_mm(const Eigen::Vector3d& point, const Rod& rod) {
    const Eigen::Vector3d along = rod.end_ct_mm - rod.begin_ct_mm;
    const double length2 = along.squaredNorm();
    const double t = length2 > 0 ? std::clamp((point - rod.begin_ct_mm).dot(along) / length2, 0.0, 1.0) : 0;
    return (point - rod.begin_ct_mm - t * along).norm();
}

/// Share of the voxel's volume inside the rod.
double share_inside(const VoxelGrid& grid, const Eigen::Vector3d& voxel, const Rod& rod) {
    const double reach_mm = grid.spacing_mm.norm() / 2;
    const double distance_mm = distance_to_segment_mm(grid.ct_from_voxel(voxel), rod);
    if (distance_mm >= rod.radius_mm + reach_mm) return 0;
    if (distance_mm + reach_mm <= rod.radius_mm) return 1;
    int inside = 0;
    for (int i = 0; i < kSubSamples * kSubSamples * kSubSamples; ++i) {
        const Eigen::Vector3i sub(i % kSubSamples, i / kSubSamples % kSubSamples, i / (kSubSamples * kSubSamples));
        const Eigen::Vector3d offset = (sub.cast<double>().array() + 0.5) / kSubSamples - 0.5;
        inside += distance_to_segment_mm(grid.ct_from_voxel(voxel + offset), rod) < rod.radius_mm;
    }
    return static_cast<double>(inside) / (kSubSamples * kSubSamples * kSubSamples);
}

}  // namespace

void add_rod(Volume& volume, const Rod& rod) {
    if (!(rod.radius_mm > 0 && std::isfinite(rod.radius_mm))) {
        throw bad_value("rod radius", std::to_string(rod.radius_mm) + " mm", "positive");
    }
    if (!(rod.attenuation_per_mm > 0 && std::isfinite(rod.attenuation_per_mm))) {
        throw bad_value("rod attenuation", std::to_string(rod.attenuation_per_mm) + " 1/mm", "positive");
    }
    if (!rod.begin_ct_mm.allFinite() || !rod.end_ct_mm.allFinite()) throw Error("rod ends: must be finite");
    volume.surface.reset();
    const Eigen::Vector3i& n = volume.grid.size;
    for (int z = 0; z < n.z(); ++z) {
        for (int y = 0; y < n.y(); ++y) {
            for (int x = 0; x < n.x(); ++x) {
                const double share = share_inside(volume.grid, {1.0 * x, 1.0 * y, 1.0 * z}, rod);
                if (share == 0) continue;
                float& voxel = volume.attenuation_per_mm[volume.index(x, y, z)];
                voxel = static_cast<float>((1 - share) * voxel + share * rod.attenuation_per_mm);
            }
        }
    }
}

void change_contrast(Volume& volume, const TissueContrast& contrast) {
    if (!(contrast.soft_gain > 0 && contrast.bone_gain > 0 && std::isfinite(contrast.soft_gain * contrast.bone_gain))) {
        throw bad_value("contrast gains",
                        std::to_string(contrast.soft_gain) + " and " + std::to_string(contrast.bone_gain), "positive");
    }
    volume.surface.reset();
    for (float& voxel : volume.attenuation_per_mm) {
        const double soft = std::min<double>(voxel, contrast.bone_from_per_mm);
        voxel = static_cast<float>(contrast.soft_gain * soft + contrast.bone_gain * (voxel - soft));
    }
}

Image with_scatter(const Image& line_integral, double ratio, double sigma_px) {
    if (!(ratio >= 0 && ratio <= 100)) throw bad_value("scatter ratio", std::to_string(ratio), "in [0, 100]");
    Image image = line_integral;
    for (float& pixel : image.pixels) pixel = std::exp(-pixel);
    const Image smooth = smoothed(image, sigma_px);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        image.pixels[i] = static_cast<float>(-std::log((image.pixels[i] + ratio * smooth.pixels[i]) / (1 + ratio)));
    }
    return image;
}

}  // namespace raylign::detail

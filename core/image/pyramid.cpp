#include "core/image/pyramid.h"

#include <algorithm>

#include "core/geometry/camera.h"

namespace raylign::detail {
namespace {

/// Mean of the (up to) 2x2x2 fine voxels under a coarse voxel; missing ones count as zero.
float mean_of_block(const Volume& fine, const Eigen::Vector3i& coarse, const Eigen::Vector3i& factor) {
    double sum = 0;
    const Eigen::Vector3i begin = coarse.cwiseProduct(factor);
    const Eigen::Vector3i end = (begin + factor).cwiseMin(fine.grid.size);
    for (int z = begin.z(); z < end.z(); ++z) {
        for (int y = begin.y(); y < end.y(); ++y) {
            for (int x = begin.x(); x < end.x(); ++x) sum += fine(x, y, z);
        }
    }
    return static_cast<float>(sum / factor.prod());
}

/// The same for a row of coarse voxels with all eight fine ones, which lie in four rows: the same sums in the same
/// order, without asking for each voxel where it is.
void means_of_blocks(const float* const (&rows)[4], int count, float* out) {
    for (int x = 0; x < count; ++x) {
        double sum = 0;
        for (const float* row : rows) {
            const float* two = row + 2 * static_cast<std::ptrdiff_t>(x);
            sum += two[0];
            sum += two[1];
        }
        out[x] = static_cast<float>(sum / 8);
    }
}

}  // namespace

Volume half_resolution(const Volume& volume, const ForEach& for_each) {
    Eigen::Vector3i factor;
    for (int axis = 0; axis < 3; ++axis) factor[axis] = volume.grid.size[axis] > 1 ? 2 : 1;
    Volume half;
    half.grid = volume.grid;
    half.grid.size = (volume.grid.size + factor - Eigen::Vector3i::Ones()).cwiseQuotient(factor);
    half.grid.spacing_mm = volume.grid.spacing_mm.cwiseProduct(factor.cast<double>());
    half.grid.origin_mm = volume.grid.ct_from_voxel((factor.cast<double>() - Eigen::Vector3d::Ones()) / 2);
    half.attenuation_per_mm.resize(static_cast<std::size_t>(half.grid.voxel_count()));
    for_each(static_cast<std::size_t>(half.grid.size.z()), [&](std::size_t layer) {
        const int z = static_cast<int>(layer);
        for (int y = 0; y < half.grid.size.y(); ++y) {
            const bool is_inside =
                factor.prod() == 8 && 2 * y + 1 < volume.grid.size.y() && 2 * z + 1 < volume.grid.size.z();
            const int whole = is_inside ? volume.grid.size.x() / 2 : 0;
            if (whole > 0) {
                const auto row = [&](int dy, int dz) {
                    return &volume.attenuation_per_mm[volume.index(0, 2 * y + dy, 2 * z + dz)];
                };
                means_of_blocks({row(0, 0), row(1, 0), row(0, 1), row(1, 1)}, whole,
                                &half.attenuation_per_mm[half.index(0, y, z)]);
            }
            for (int x = whole; x < half.grid.size.x(); ++x) {
                half.attenuation_per_mm[half.index(x, y, z)] = mean_of_block(volume, {x, y, z}, factor);
            }
        }
    });
    return half;
}

View half_resolution(const View& view) {
    const ViewGeometry geometry{half_resolution(view.geometry.camera), view.geometry.camera_from_world};
    View half{view.name, geometry, {}, {}, view.cost_weight, view.ceiling, view.by_transmission};
    if (view.image.empty() && view.weights.empty()) return half;
    const int width = half.geometry.camera.size_px.x(), height = half.geometry.camera.size_px.y();
    if (!view.image.empty()) half.image = Image(width, height);
    if (!view.weights.empty()) half.weights = Image(width, height);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            double weight_sum = 0, value_sum = 0;
            for (int k = 0; k < 4; ++k) {
                const int fx = 2 * x + k % 2, fy = 2 * y + k / 2;
                const double weight = view.weights.empty() ? 1 : view.weights(fx, fy);
                if (weight == 0) continue;  // a masked pixel may be NaN, and 0 * NaN is NaN
                weight_sum += weight;
                if (!view.image.empty()) value_sum += weight * view.image(fx, fy);
            }
            if (!half.image.empty()) half.image(x, y) = static_cast<float>(weight_sum > 0 ? value_sum / weight_sum : 0);
            if (!half.weights.empty()) half.weights(x, y) = static_cast<float>(weight_sum / 4);
        }
    }
    return half;
}

View halved(const View& view, int times) {
    if (times <= 0) return view;
    View half = half_resolution(view);
    for (int i = 1; i < times; ++i) half = half_resolution(half);
    return half;
}

}  // namespace raylign::detail

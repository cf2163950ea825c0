#include "apps/viewer/embedded.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/image/pyramid.h"
#include "core/image/region.h"

namespace raylign::detail::apps {
namespace {

constexpr double kShareOfDensest = 1e-4;
constexpr double kWhiteOverDensest = 2;

double white_of(const Volume& volume) {
    std::vector<float> dense;
    for (const float value : volume.attenuation_per_mm) {
        if (value > 0) dense.push_back(value);
    }
    if (dense.empty()) throw Error("the volume shows nothing: no voxel attenuates");
    const auto rank = static_cast<std::ptrdiff_t>(std::ceil((1 - kShareOfDensest) * (dense.size() - 1)));
    std::ranges::nth_element(dense, dense.begin() + rank);
    const double densest = dense[rank];
    return std::min<double>(*std::ranges::max_element(dense), kWhiteOverDensest * densest);
}

void quantize(const Volume& volume, EmbeddedVolume& result) {
    result.values.reserve(volume.attenuation_per_mm.size());
    std::size_t clipped = 0, dense = 0;
    for (const float value : volume.attenuation_per_mm) {
        clipped += value > result.white_per_mm;
        dense += value > 0;
        const double level = std::clamp(value / result.white_per_mm, 0.0, 1.0) * 255;
        result.values.push_back(static_cast<std::uint8_t>(std::lround(level)));
    }
    result.clipped_share = static_cast<double>(clipped) / static_cast<double>(dense);
}

/// Calls add(weight, point in ct) for each voxel.
template <class Add>
void for_voxels(const EmbeddedVolume& volume, const Add& add) {
    std::size_t i = 0;
    for (int z = 0; z < volume.grid.size.z(); ++z) {
        for (int y = 0; y < volume.grid.size.y(); ++y) {
            for (int x = 0; x < volume.grid.size.x(); ++x, ++i) {
                if (volume.values[i] > 0)
                    add(double{1} * volume.values[i], volume.grid.ct_from_voxel({1. * x, 1. * y, 1. * z}));
            }
        }
    }
}

void measure(EmbeddedVolume& volume) {
    double mass = 0, spread = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for_voxels(volume, [&](double weight, const Eigen::Vector3d& x_ct) {
        mass += weight;
        sum += weight * x_ct;
    });
    if (!(mass > 0)) throw Error("the volume shows nothing: in 8 bit all of it is black");
    volume.centre_ct_mm = sum / mass;
    for_voxels(volume, [&](double weight, const Eigen::Vector3d& x_ct) {
        spread += weight * (x_ct - volume.centre_ct_mm).squaredNorm();
    });
    volume.radius_mm = std::sqrt(spread / mass);
}

}  // namespace

EmbeddedVolume embedded(const Volume& volume, int longest_side) {
    Volume part = crop(volume, box_of_object(volume));
    EmbeddedVolume result;
    for (; part.grid.size.maxCoeff() > longest_side; ++result.halvings) part = half_resolution(part);
    result.grid = part.grid;
    result.white_per_mm = white_of(part);
    quantize(part, result);
    measure(result);
    return result;
}

EmbeddedView embedded(const View& view, int longest_side_px) {
    EmbeddedView result{view, 0};
    for (; result.view.geometry.camera.size_px.maxCoeff() > longest_side_px; ++result.halvings) {
        result.view = half_resolution(result.view);
    }
    return result;
}

}  // namespace raylign::detail::apps

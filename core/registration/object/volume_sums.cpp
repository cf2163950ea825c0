#include "core/registration/object/volume_sums.h"

#include <algorithm>
#include <cmath>

namespace raylign::detail {
namespace {

/// Of voxels next to each other along x, which begin at 0.
struct StretchSums {
    double mass = 0, first = 0, second = 0, attenuating = 0;
    int attenuating_count = 0;

    void add(float voxel, double x) {
        const double mass_here = std::abs(voxel), moment = mass_here * x;
        mass += mass_here;
        first += moment;
        second += moment * x;
        attenuating += std::max(0.F, voxel);
        attenuating_count += voxel > 0;
    }
    StretchSums& operator+=(const StretchSums& other) {
        mass += other.mass;
        first += other.first;
        second += other.second;
        attenuating += other.attenuating;
        attenuating_count += other.attenuating_count;
        return *this;
    }
};

/// Four voxels in turn, each to sums of its own, which would else wait for each other. Of some tens of voxels floats
/// hold them to 1e-6.
StretchSums sums_of(const float* voxels, int count) {
    constexpr int kLanes = 4;
    using Lanes = Eigen::Array<float, kLanes, 1>;
    Lanes mass = Lanes::Zero(), first = mass, second = mass, attenuating = mass, x(0, 1, 2, 3);
    int i = 0;
    for (; i + kLanes <= count; i += kLanes, x += kLanes) {
        const Lanes here = Eigen::Map<const Lanes>(voxels + i);
        const Lanes mass_here = here.abs(), moment = mass_here * x;
        mass += mass_here;
        first += moment;
        second += moment * x;
        attenuating += here.max(0.F);
    }
    StretchSums sums{mass.sum(), first.sum(), second.sum(), attenuating.sum()};
    for (int k = 0; k < i; ++k) sums.attenuating_count += voxels[k] > 0;
    for (; i < count; ++i) sums.add(voxels[i], i);
    return sums;
}

/// The same sums of positions that begin at x0.
StretchSums moved(StretchSums sums, double x0) {
    sums.second += x0 * (2 * sums.first + x0 * sums.mass);
    sums.first += x0 * sums.mass;
    return sums;
}

/// Of a row along x. `of_cells`: of those that it runs through, what is above 0 is added.
StretchSums sums_of_row(const float* voxels, int size, int cell, double* of_cells) {
    StretchSums row;  // a sum of positions over 10^8 voxels would lose digits
    for (int x0 = 0; x0 < size; x0 += cell, ++of_cells) {
        const StretchSums stretch = sums_of(voxels + x0, std::min(cell, size - x0));
        *of_cells += stretch.attenuating;
        row += moved(stretch, x0);
    }
    return row;
}

/// Adds a row's sums, all but those of cells.
void add_row(VolumeSums& sums, const StretchSums& row, int y, int z) {
    const Eigen::Vector3d moment(row.first, row.mass * y, row.mass * z);
    sums.mass += row.mass;
    sums.first += moment;
    sums.second.row(0) += Eigen::RowVector3d(row.second, row.first * y, row.first * z);
    sums.second.row(1) += y * moment.transpose();
    sums.second.row(2) += z * moment.transpose();
    sums.attenuating += row.attenuating;
    sums.attenuating_count += row.attenuating_count;
}

}  // namespace

VolumeSums volume_sums(const Volume& volume, const ForEach& for_each) {
    const Eigen::Vector3i& size = volume.grid.size;
    VolumeSums sums;
    sums.cell = std::max(1, (size.maxCoeff() + kCellsAlong - 1) / kCellsAlong);
    sums.cells = (size.array() + sums.cell - 1) / sums.cell;
    sums.of_cells.resize(static_cast<std::size_t>(sums.cells.prod()));
    std::vector<VolumeSums> layers(static_cast<std::size_t>(sums.cells.z()));  // of cells
    for_each(layers.size(), [&](std::size_t layer) {
        const int begin = static_cast<int>(layer) * sums.cell, end = std::min(begin + sums.cell, size.z());
        for (int z = begin; z < end; ++z) {
            for (int y = 0; y < size.y(); ++y) {
                const std::size_t cells = (layer * sums.cells.y() + y / sums.cell) * sums.cells.x();
                const float* const voxels = &volume.attenuation_per_mm[volume.index(0, y, z)];
                add_row(layers[layer], sums_of_row(voxels, size.x(), sums.cell, &sums.of_cells[cells]), y, z);
            }
        }
    });
    for (const VolumeSums& layer : layers) {
        sums.mass += layer.mass;
        sums.first += layer.first;
        sums.second += layer.second;
        sums.attenuating += layer.attenuating;
        sums.attenuating_count += layer.attenuating_count;
    }
    return sums;
}

}  // namespace raylign::detail

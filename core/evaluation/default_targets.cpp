#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <string>

#include "core/base/error.h"
#include "core/evaluation/dense_part.h"
#include "raylign/intensity.h"
#include "raylign/targets.h"

namespace raylign {
using namespace detail;
namespace {

constexpr double kDenseHu = 200;            // cancellous bone and denser
constexpr std::size_t kDenseVoxels = 1000;  // one cm^3 of 1-mm voxels: more than an implant's speckle
constexpr double kPercentile = 0.999;
constexpr int kHistogramBins = 1 << 14;  // the percentile is read to 1/16384 of the maximum
constexpr int kBlocksPerAxis = 96;       // the cells' side is chosen on a coarse map, to stay quick
constexpr int kPointsPerCell = 20;       // but not on a coarser one than gives this many points a cell

double percentile_of_positive(const std::vector<float>& values, float maximum) {
    std::vector<std::size_t> histogram(kHistogramBins);
    std::size_t positive = 0;
    const double bins_per_unit = kHistogramBins / static_cast<double>(maximum);
    for (const float value : values) {
        if (!(value > 0)) continue;
        ++histogram[std::min(kHistogramBins - 1, static_cast<int>(value * bins_per_unit))];
        ++positive;
    }
    std::size_t seen = 0;
    int bin = 0;
    for (; bin < kHistogramBins - 1; ++bin) {
        seen += histogram[bin];
        if (static_cast<double>(seen) >= kPercentile * static_cast<double>(positive)) break;
    }
    return (bin + 0.5) / bins_per_unit;
}

/// Calls act(voxel) for every voxel above the threshold, x fastest.
template <class Action>
void for_each_dense(const Volume& volume, float threshold_per_mm, const Action& act) {
    const float* value = volume.attenuation_per_mm.data();
    for (int z = 0; z < volume.grid.size.z(); ++z) {
        for (int y = 0; y < volume.grid.size.y(); ++y) {
            for (int x = 0; x < volume.grid.size.x(); ++x, ++value) {
                if (*value > threshold_per_mm) act(Eigen::Array3i(x, y, z));
            }
        }
    }
}

/// Cubic cells over the dense part's bounding box, in voxel coordinates.
struct Cells {
    Eigen::Array3d low_voxel;
    Eigen::Array3d side_voxel;  ///< the same length in mm on each axis

    [[nodiscard]] Eigen::Array3i cell_of(const Eigen::Array3d& voxel) const {
        return ((voxel - low_voxel) / side_voxel).floor().cast<int>();
    }
    [[nodiscard]] std::int64_t key(const Eigen::Array3d& voxel) const {
        const Eigen::Array3i c = cell_of(voxel);
        return (static_cast<std::int64_t>(c.z()) << 40) + (static_cast<std::int64_t>(c.y()) << 20) + c.x();
    }
    [[nodiscard]] Eigen::Array3d centre_voxel(const Eigen::Array3d& voxel) const {
        return low_voxel + (cell_of(voxel).cast<double>() + 0.5) * side_voxel;
    }
};

/// The dense part, coarsely: one dense voxel of each block of block^3 voxels that has one.
struct DenseMap {
    Eigen::Array3d low_voxel = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity());
    Eigen::Array3d high_voxel = -low_voxel;
    std::vector<Eigen::Array3d> points_voxel;
};

DenseMap dense_map(const Volume& volume, float threshold_per_mm, int block) {
    const Eigen::Array3i blocks = (volume.grid.size.array() + block - 1) / block;
    std::vector<bool> taken(static_cast<std::size_t>(blocks.x()) * blocks.y() * blocks.z());
    DenseMap map;
    for_each_dense(volume, threshold_per_mm, [&](const Eigen::Array3i& voxel) {
        const Eigen::Array3d at = voxel.cast<double>();
        map.low_voxel = map.low_voxel.min(at);
        map.high_voxel = map.high_voxel.max(at);
        const Eigen::Array3i b = voxel / block;
        const std::size_t index = (static_cast<std::size_t>(b.z()) * blocks.y() + b.y()) * blocks.x() + b.x();
        if (taken[index]) return;
        taken[index] = true;
        map.points_voxel.push_back(at);
    });
    return map;
}

DenseMap dense_map_for(const Volume& volume, float threshold_per_mm, int count) {
    int block = (volume.grid.size.maxCoeff() + kBlocksPerAxis - 1) / kBlocksPerAxis;
    for (;; block /= 2) {
        DenseMap map = dense_map(volume, threshold_per_mm, block);
        if (block == 1 || map.points_voxel.size() >= static_cast<std::size_t>(count) * kPointsPerCell) return map;
    }
}

Cells cells_of_side(const DenseMap& map, double side_mm, const VoxelGrid& grid) {
    return {map.low_voxel - 0.5, side_mm / grid.spacing_mm.array()};
}

std::size_t occupied(const DenseMap& map, const Cells& cells) {
    std::vector<std::int64_t> keys;
    for (const Eigen::Array3d& point : map.points_voxel) keys.push_back(cells.key(point));
    std::ranges::sort(keys);
    return std::unique(keys.begin(), keys.end()) - keys.begin();
}

/// Bisects (in the logarithm) for the side at which `count` cells are occupied. Their number rises in steps as the
/// side shrinks.
Cells choose_cells(const DenseMap& map, int count, const VoxelGrid& grid) {
    const Eigen::Array3d box_mm = (map.high_voxel - map.low_voxel + 1) * grid.spacing_mm.array();
    double small_mm = grid.spacing_mm.minCoeff(), large_mm = std::max(small_mm, box_mm.maxCoeff());
    // Each turn halves the logarithm's range: 2^-16 of it is far below one cell more or less.
    for (int i = 0; i < 16; ++i) {
        const double side_mm = std::sqrt(small_mm * large_mm);
        const bool enough = occupied(map, cells_of_side(map, side_mm, grid)) >= static_cast<std::size_t>(count);
        (enough ? small_mm : large_mm) = side_mm;
    }
    return cells_of_side(map, small_mm, grid);
}

/// The dense voxel nearest to its cell's centre; the first in the volume's order where two are as near.
struct Nearest {
    Eigen::Array3d voxel;
    double distance2_mm2 = std::numeric_limits<double>::infinity();
};

std::map<std::int64_t, Nearest> nearest_to_centres(const Volume& volume, float threshold_per_mm, const Cells& cells) {
    std::map<std::int64_t, Nearest> nearest;
    auto place = nearest.end();  // neighbours mostly share a cell: looked up once a run
    for_each_dense(volume, threshold_per_mm, [&](const Eigen::Array3i& voxel) {
        const Eigen::Array3d at = voxel.cast<double>();
        const std::int64_t key = cells.key(at);
        if (place == nearest.end() || place->first != key) place = nearest.try_emplace(key).first;
        const Eigen::Array3d offset_mm = (at - cells.centre_voxel(at)) * volume.grid.spacing_mm.array();
        const double distance2_mm2 = offset_mm.matrix().squaredNorm();
        if (distance2_mm2 < place->second.distance2_mm2) place->second = {at, distance2_mm2};
    });
    return nearest;
}

}  // namespace

double detail::dense_threshold_per_mm(const Volume& volume) {
    const float bone_per_mm = attenuation_from_hu(kDenseHu, hu_presets().front());
    float maximum = 0;
    std::size_t above = 0;
    for (const float value : volume.attenuation_per_mm) {
        maximum = std::max(maximum, value);
        above += value > bone_per_mm;
    }
    if (!(maximum > 0)) throw Error("targets: the volume has no voxel with positive attenuation");
    if (above >= kDenseVoxels) return bone_per_mm;
    return percentile_of_positive(volume.attenuation_per_mm, maximum) / 2;
}

std::vector<Eigen::Vector3d> default_targets_ct_mm(const Volume& volume, int count) {
    if (count < 1 || count > 10000) throw bad_value("number of targets", std::to_string(count), "in [1, 10000]");
    const auto threshold_per_mm = static_cast<float>(dense_threshold_per_mm(volume));
    const Cells cells = choose_cells(dense_map_for(volume, threshold_per_mm, count), count, volume.grid);
    std::vector<Eigen::Vector3d> targets_ct_mm;
    for (const auto& [key, target] : nearest_to_centres(volume, threshold_per_mm, cells)) {
        targets_ct_mm.push_back(volume.grid.ct_from_voxel(target.voxel.matrix()));
    }
    return targets_ct_mm;
}

}  // namespace raylign

#include "core/registration/object/continued.h"

#include <algorithm>
#include <cmath>

namespace raylign::detail {
namespace {

constexpr double kWholePlane = 0.75;

double sum_of_plane(const Volume& volume, int axis, int plane) {
    Eigen::Vector3i low = Eigen::Vector3i::Zero(), high = volume.grid.size;
    low[axis] = plane;
    high[axis] = plane + 1;
    double sum = 0;
    for (int z = low.z(); z < high.z(); ++z) {
        for (int y = low.y(); y < high.y(); ++y) {
            for (int x = low.x(); x < high.x(); ++x) sum += volume(x, y, z);
        }
    }
    return sum;
}

/// The plane that is repeated.
int last_whole_plane(const Volume& volume, const CutFace& face) {
    const int size = volume.grid.size[face.axis];
    const int outer = face.is_high ? size - 1 : 0, inner = face.is_high ? size - 2 : 1;
    if (size < 2) return outer;
    const bool is_mixed = sum_of_plane(volume, face.axis, outer) < kWholePlane * sum_of_plane(volume, face.axis, inner);
    return is_mixed ? inner : outer;
}

}  // namespace

Volume continued(const Volume& volume, std::span<const CutFace> faces, double width_mm) {
    Eigen::Vector3i before = Eigen::Vector3i::Zero(), after = Eigen::Vector3i::Zero();
    Eigen::Vector3i first = Eigen::Vector3i::Zero(), last = volume.grid.size.array() - 1;  // planes that are kept
    for (const CutFace& face : faces) {
        const int planes = static_cast<int>(std::ceil(width_mm / volume.grid.spacing_mm[face.axis]));
        (face.is_high ? after : before)[face.axis] = planes;
        (face.is_high ? last : first)[face.axis] = last_whole_plane(volume, face);
    }
    Volume result;
    result.grid = volume.grid;
    result.grid.size += before + after;
    result.grid.origin_mm = volume.grid.ct_from_voxel(-before.cast<double>());
    result.attenuation_per_mm.reserve(static_cast<std::size_t>(result.grid.voxel_count()));
    const auto source = [&](int axis, int i) { return std::clamp(i - before[axis], first[axis], last[axis]); };
    for (int z = 0; z < result.grid.size.z(); ++z) {
        for (int y = 0; y < result.grid.size.y(); ++y) {
            for (int x = 0; x < result.grid.size.x(); ++x) {
                result.attenuation_per_mm.push_back(volume(source(0, x), source(1, y), source(2, z)));
            }
        }
    }
    return result;
}

}  // namespace raylign::detail

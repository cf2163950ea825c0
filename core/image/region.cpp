#include "core/image/region.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "core/base/error.h"

namespace raylign::detail {
namespace {

/// Calls body(x, y, z, voxel) for every voxel.
template <typename Body>
void for_each_voxel(Volume& volume, Body body) {
    std::size_t i = 0;
    for (int z = 0; z < volume.grid.size.z(); ++z) {
        for (int y = 0; y < volume.grid.size.y(); ++y) {
            for (int x = 0; x < volume.grid.size.x(); ++x) body(x, y, z, volume.attenuation_per_mm[i++]);
        }
    }
}

std::string point_text(const Eigen::Vector3d& point) {
    return "(" + std::to_string(point.x()) + ", " + std::to_string(point.y()) + ", " + std::to_string(point.z()) + ")";
}

/// Extent of the grid's voxel centres along the axes of ct [mm].
CtBox extent_of(const VoxelGrid& grid) {
    CtBox extent{grid.origin_mm, grid.origin_mm};
    for (int corner = 0; corner < 8; ++corner) {
        Eigen::Vector3d voxel = Eigen::Vector3d::Zero();
        for (int axis = 0; axis < 3; ++axis) voxel[axis] = (corner >> axis & 1) != 0 ? grid.size[axis] - 1 : 0;
        extent.low_mm = extent.low_mm.cwiseMin(grid.ct_from_voxel(voxel));
        extent.high_mm = extent.high_mm.cwiseMax(grid.ct_from_voxel(voxel));
    }
    return extent;
}

std::string extent_text(const VoxelGrid& grid) {
    const CtBox extent = extent_of(grid);
    return "the CT lies within " + point_text(extent.low_mm) + " to " + point_text(extent.high_mm) + " mm";
}

/// Affine map of voxel coordinates of one grid to those of another.
struct VoxelMap {
    Eigen::Matrix3d matrix;
    Eigen::Vector3d offset;
};

VoxelMap voxel_map(const VoxelGrid& from, const VoxelGrid& to) {
    const Eigen::Vector3d offset = to.voxel_from_ct(from.origin_mm);
    Eigen::Matrix3d matrix;
    for (int axis = 0; axis < 3; ++axis) {
        matrix.col(axis) = to.voxel_from_ct(from.ct_from_voxel(Eigen::Vector3d::Unit(axis))) - offset;
    }
    return {matrix, offset};
}

void check_labels(const LabelMap& map, std::span<const std::int32_t> kept) {
    constexpr std::size_t kMostNamed = 40;
    const std::set<std::int32_t> present(map.labels.begin(), map.labels.end());
    std::string list;
    std::size_t named = 0;
    for (const std::int32_t label : present) {
        if (label == 0) continue;
        if (++named > kMostNamed) continue;
        list += (list.empty() ? "" : ", ") + std::to_string(label);
    }
    if (named > kMostNamed) list += " and " + std::to_string(named - kMostNamed) + " more";
    if (list.empty()) throw Error("the label map is 0 everywhere");
    for (const std::int32_t label : kept) {
        if (label == 0 || !present.contains(label)) {
            throw bad_value("label", std::to_string(label), "one of the map's: " + list);
        }
    }
}

}  // namespace

VoxelBox box_of_object(const Volume& volume) {
    VoxelBox box{volume.grid.size, Eigen::Vector3i::Zero()};
    std::size_t i = 0;
    for (int z = 0; z < volume.grid.size.z(); ++z) {
        for (int y = 0; y < volume.grid.size.y(); ++y) {
            for (int x = 0; x < volume.grid.size.x(); ++x) {
                if (volume.attenuation_per_mm[i++] == 0) continue;
                box.begin = box.begin.cwiseMin(Eigen::Vector3i(x, y, z));
                box.end = box.end.cwiseMax(Eigen::Vector3i(x + 1, y + 1, z + 1));
            }
        }
    }
    if (!(box.begin.array() < box.end.array()).all()) throw Error("the volume is 0 everywhere: no object is left");
    return box;
}

Volume crop(const Volume& volume, const VoxelBox& box) {
    const bool is_inside = (box.begin.array() >= 0).all() && (box.end.array() <= volume.grid.size.array()).all();
    if (!is_inside || !(box.begin.array() < box.end.array()).all()) {
        throw Error("box of voxels from " + point_text(box.begin.cast<double>()) + " to " +
                    point_text(box.end.cast<double>()) + ": must not be empty and lie within 0 to " +
                    point_text(volume.grid.size.cast<double>()));
    }
    Volume part;
    part.grid = volume.grid;
    part.grid.size = box.end - box.begin;
    part.grid.origin_mm = volume.grid.ct_from_voxel(box.begin.cast<double>());
    part.attenuation_per_mm.reserve(static_cast<std::size_t>(part.grid.voxel_count()));
    for (int z = box.begin.z(); z < box.end.z(); ++z) {
        for (int y = box.begin.y(); y < box.end.y(); ++y) {
            const float* const row = &volume.attenuation_per_mm[volume.index(box.begin.x(), y, z)];
            part.attenuation_per_mm.insert(part.attenuation_per_mm.end(), row, row + part.grid.size.x());
        }
    }
    return part;
}

void clip_above(Volume& volume, float attenuation_per_mm) {
    for (float& voxel : volume.attenuation_per_mm) voxel = std::min(voxel, attenuation_per_mm);
}

void keep_inside(Volume& volume, const CtBox& box) {
    if (!(box.low_mm.array() <= box.high_mm.array()).all()) {
        throw Error("box from " + point_text(box.low_mm) + " to " + point_text(box.high_mm) +
                    " mm: each first corner must be at most the second");
    }
    std::size_t kept = 0;
    for_each_voxel(volume, [&](int x, int y, int z, float& voxel) {
        const Eigen::Vector3d point = volume.grid.ct_from_voxel({double(x), double(y), double(z)});
        if ((point.array() >= box.low_mm.array()).all() && (point.array() <= box.high_mm.array()).all()) {
            ++kept;
        } else {
            voxel = 0;
        }
    });
    if (kept == 0) {
        throw Error("box from " + point_text(box.low_mm) + " to " + point_text(box.high_mm) +
                    " mm holds no voxel's centre: " + extent_text(volume.grid));
    }
}

void keep_labels(Volume& volume, const LabelMap& map, std::span<const std::int32_t> kept) {
    check_labels(map, kept);
    const VoxelMap label_from_voxel = voxel_map(volume.grid, map.grid);
    std::size_t covered = 0;
    for_each_voxel(volume, [&](int x, int y, int z, float& voxel) {
        const Eigen::Vector3d place = label_from_voxel.matrix * Eigen::Vector3d(x, y, z) + label_from_voxel.offset +
                                      Eigen::Vector3d::Constant(0.5);
        std::int32_t label = 0;
        if ((place.array() >= 0).all() && (place.array() < map.grid.size.cast<double>().array()).all()) {
            const Eigen::Vector3i nearest = place.array().floor().cast<int>();
            label = map.labels[(static_cast<std::size_t>(nearest.z()) * map.grid.size.y() + nearest.y()) *
                                   map.grid.size.x() +
                               nearest.x()];
            ++covered;
        }
        if (std::ranges::find(kept, label) == kept.end()) voxel = 0;
    });
    if (covered == 0) throw Error("the label map and the CT do not overlap: " + extent_text(volume.grid));
}

void contrast_above(Volume& volume, float attenuation_per_mm) {
    for (float& voxel : volume.attenuation_per_mm) voxel = std::max(0.F, voxel - attenuation_per_mm);
}

namespace {

/// Multiplies every voxel by the product over axes of min(1, distance / width); distance_mm(x, y, z) gives the three
/// smaller distances to a face.
template <class Distance>
void fade(Volume& volume, double width_mm, const Distance& distance_mm) {
    if (!(width_mm > 0)) throw bad_value("fading width", std::to_string(width_mm) + " mm", "positive");
    const Eigen::Vector3i& n = volume.grid.size;
    for (int z = 0; z < n.z(); ++z) {
        for (int y = 0; y < n.y(); ++y) {
            for (int x = 0; x < n.x(); ++x) {
                const Eigen::Array3d inside = (distance_mm(x, y, z) / width_mm).max(0.0).min(1.0);
                volume.attenuation_per_mm[volume.index(x, y, z)] *= static_cast<float>(inside.prod());
            }
        }
    }
}

}  // namespace

void fade_faces(Volume& volume, const CtBox& box, double width_mm) {
    fade(volume, width_mm, [&](int x, int y, int z) -> Eigen::Array3d {
        const Eigen::Vector3d at_mm = volume.grid.ct_from_voxel({1.0 * x, 1.0 * y, 1.0 * z});
        return (at_mm - box.low_mm).array().min((box.high_mm - at_mm).array());
    });
}

void fade_sides(Volume& volume, double width_mm) {
    const Eigen::Array3d n = volume.grid.size.cast<double>().array(), spacing_mm = volume.grid.spacing_mm.array();
    fade(volume, width_mm, [&](int x, int y, int z) -> Eigen::Array3d {
        const Eigen::Array3d voxel(x, y, z);
        return (voxel + 0.5).min(n - 0.5 - voxel) * spacing_mm;
    });
}

}  // namespace raylign::detail

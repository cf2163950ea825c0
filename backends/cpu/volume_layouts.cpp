#include "backends/cpu/volume_layouts.h"

#include <algorithm>

#include "core/base/error.h"

namespace raylign::detail::cpu {
namespace {

constexpr MemoryOrder kOrders[] = {{2, 1, 0}, {0, 2, 1}, {2, 1, 0}};
constexpr MemoryOrder kOwnY = {1, 2, 0};  ///< of the first copy, where z has one of its own

/// 32-bit offsets reach everything in a copy.
bool is_shared(const BrickMap& map) {
    return VolumeCopy::span_bytes(map, kOrders[0], kInt16) < 0x1p31 * sizeof(std::int16_t);
}

MemoryOrder order_of(const BrickMap& map, int copy) { return copy == 0 && !is_shared(map) ? kOwnY : kOrders[copy]; }

int blocks(int voxels) { return voxels / kBlockVoxels + (voxels % kBlockVoxels != 0 ? 1 : 0); }

/// See PlaneLayout::occupied: a block is a slab's planes, two bricks.
std::vector<std::int32_t> occupied_table(const BrickMap& map, int axis) {
    const auto& order = kAxisOrder[axis];
    const int slabs = (map.bricks[order[0]] + 1) / 2, rows = map.bricks[order[1]], columns = map.bricks[order[2]];
    const std::size_t stride = columns + 1, table = stride * (rows + 1);
    std::vector<std::int32_t> sums(slabs * table, 0);
    for (int slab = 0; slab < slabs; ++slab) {
        for (int row = 0; row < rows; ++row) {
            for (int column = 0; column < columns; ++column) {
                int at[3], any = 0;
                at[order[1]] = row;
                at[order[2]] = column;
                for (at[order[0]] = 2 * slab; at[order[0]] < std::min(2 * slab + 2, map.bricks[order[0]]);
                     ++at[order[0]])
                    any |= map.occupied[map.index(at[0], at[1], at[2])];
                std::int32_t* entry = &sums[slab * table + (row + 1) * stride + column + 1];
                *entry = any + entry[-1] + entry[-static_cast<std::ptrdiff_t>(stride)] -
                         entry[-static_cast<std::ptrdiff_t>(stride) - 1];
            }
        }
    }
    return sums;
}

}  // namespace

double layout_bytes(const BrickMap& map, VoxelStorage storage) {
    double bytes = 0;
    for (int copy = 0; copy < (is_shared(map) ? 2 : 3); ++copy) {
        bytes += VolumeCopy::span_bytes(map, order_of(map, copy), storage);
    }
    return bytes;
}

VoxelStorage choose_storage(const BrickMap& map, const StorageRule& rule) {
    if (rule.wanted) return *rule.wanted;
    return rule.preferred == kFloat32 && layout_bytes(map, kFloat32) <= rule.max_bytes ? kFloat32 : kInt16;
}

VolumeLayouts make_layouts(const Volume& volume, const StorageRule& rule, int first_axis, Workers& workers) {
    const int size[3] = {volume.grid.size.x(), volume.grid.size.y(), volume.grid.size.z()};
    const float* const voxels = volume.attenuation_per_mm.data();
    const BrickMap map = map_bricks(voxels, size, workers);
    const VoxelSource source{voxels,    kFloat32,
                             1,         {1, size[0], static_cast<std::ptrdiff_t>(size[0]) * size[1]},
                             {0, 0, 0}, {size[0], size[1], size[2]}};
    return {source, map, choose_storage(map, rule), first_axis, workers};
}

VolumeLayouts::VolumeLayouts(const VoxelSource& source, const BrickMap& map, VoxelStorage storage, int first_axis,
                             Workers& workers)
    : map_(map), storage_(storage), unit_per_mm_(storage == kInt16 && map.largest > 0 ? map.largest / 32767 : 1) {
    const double bytes = layout_bytes(map_, storage_), free = static_cast<double>(free_memory());
    if (bytes > free) {
        throw Error("memory: the backend's volume needs " + std::to_string(static_cast<long long>(bytes / 0x1p20) + 1) +
                    " MiB as " + (storage_ == kInt16 ? "int16" : "float32 (int16: half of it)") + ", and only " +
                    std::to_string(static_cast<long long>(free / 0x1p20)) + " MiB are free");
    }
    make_from(source, first_axis, workers);
}

int VolumeLayouts::copy_of(int axis) const { return axis == 0 ? 1 : axis == 1 || is_shared(map_) ? 0 : 2; }

void VolumeLayouts::make(int axis, Workers& workers) {
    if (has(axis)) {
        if (occupied_[axis].empty()) occupied_[axis] = occupied_table(map_, axis);
        return;
    }
    for (const auto& made : copies_) {
        if (!made) continue;
        make_from(made->as_source(), axis, workers);
        return;
    }
}

void VolumeLayouts::make_from(const VoxelSource& source, int axis, Workers& workers) {
    const int copy = copy_of(axis);
    copies_[copy] = std::make_unique<VolumeCopy>(source, map_, order_of(map_, copy), storage_, unit_per_mm_, workers);
    occupied_[axis] = occupied_table(map_, axis);
}

PlaneLayout VolumeLayouts::view(int axis) const {
    if (!has(axis) || occupied_[axis].empty()) return {};
    PlaneLayout view = copies_[copy_of(axis)]->view(axis);
    view.occupied = occupied_[axis].data();
    view.block_rows = blocks(view.rows);
    view.block_columns = blocks(view.columns);
    return view;
}

std::size_t VolumeLayouts::bytes() const {
    std::size_t bytes = map_.occupied.size();
    for (const auto& copy : copies_) bytes += copy ? copy->bytes() : 0;
    for (const auto& table : occupied_) bytes += table.size() * sizeof(std::int32_t);
    return bytes;
}

std::string VolumeLayouts::description() const {
    const auto copies = std::ranges::count_if(copies_, [](const auto& copy) { return copy != nullptr; });
    std::string text = storage_ == kInt16 ? "int16" : "float32";
    text += ", " + std::to_string(copies) + (copies == 1 ? " copy of" : " copies of");
    for (int axis = 0; axis < 3; ++axis) {
        text += (axis == 0 ? " " : " x ") + std::to_string(map_.end[axis] - map_.begin[axis]);
    }
    text += " of";
    for (int axis = 0; axis < 3; ++axis) text += (axis == 0 ? " " : " x ") + std::to_string(map_.voxels[axis]);
    return text + " voxels";
}

}  // namespace raylign::detail::cpu

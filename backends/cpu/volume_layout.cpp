#include "backends/cpu/volume_layout.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace raylign::cpu {
namespace {

int blocks(int voxels) { return (voxels + kBlockVoxels - 1) / kBlockVoxels; }

/// The unit of int16 voxels for a source of floats.
float int16_unit(const VolumeLayout::Source& source) {
    const auto* voxels = static_cast<const float*>(source.voxels);
    float largest = 0;
    for (int z = 0; z < source.size[2]; ++z) {
        for (int y = 0; y < source.size[1]; ++y) {
            const float* row = voxels + z * source.stride[2] + y * source.stride[1];
            for (int x = 0; x < source.size[0]; ++x) largest = std::max(largest, std::abs(row[x * source.stride[0]]));
        }
    }
    return largest > 0 ? largest / 32767 : 1;
}

template <class To, class From>
To converted(From value, float per_unit) {
    if constexpr (std::is_same_v<To, From>) return value;
    return static_cast<To>(std::lrint(static_cast<float>(value) * per_unit));
}

/// One plane, in squares: both sides of a transpose stay in the cache.
template <class To, class From>
void copy_plane(To* to, std::ptrdiff_t to_row, const From* from, std::ptrdiff_t from_row, std::ptrdiff_t from_column,
                int rows, int columns, float per_unit) {
    constexpr int kSquare = 16;
    for (int row0 = 0; row0 < rows; row0 += kSquare) {
        for (int column0 = 0; column0 < columns; column0 += kSquare) {
            const int row1 = std::min(row0 + kSquare, rows), column1 = std::min(column0 + kSquare, columns);
            for (int row = row0; row < row1; ++row) {
                for (int column = column0; column < column1; ++column) {
                    to[row * to_row + column] = converted<To>(from[row * from_row + column * from_column], per_unit);
                }
            }
        }
    }
}

}  // namespace

VolumeLayout::VolumeLayout(const Source& source, int axis, VoxelStorage storage, Workers& workers)
    : axis_(axis), storage_(storage) {
    const auto& order = kAxisOrder[axis];
    view_.planes = source.size[order[0]];
    view_.rows = source.size[order[1]];
    view_.columns = source.size[order[2]];
    // Rows start on a cache line; an odd number of lines apart, so that the rows of a footprint fall into different
    // sets.
    const std::size_t voxel_bytes = storage == kInt16 ? sizeof(std::int16_t) : sizeof(float);
    const std::ptrdiff_t line = 64 / voxel_bytes;
    view_.row_stride = ((view_.columns + 2 * kPadVoxels + line - 1) / line | 1) * line;
    view_.plane_stride = view_.row_stride * (view_.rows + 2 * kPadVoxels);
    voxels_ = PageBuffer(static_cast<std::size_t>(view_.plane_stride) * (view_.planes + 3) * voxel_bytes,
                         "the engine's volume");
    const std::ptrdiff_t first = view_.plane_stride + kPadVoxels * view_.row_stride + kPadVoxels;
    view_.origin = static_cast<const char*>(voxels_.data()) + first * voxel_bytes;
    view_.block_rows = blocks(view_.rows);
    view_.block_columns = blocks(view_.columns);
    const std::size_t slabs = (view_.planes + kSlabPlanes - 1) / kSlabPlanes;
    occupied_.assign(slabs * (view_.block_rows + 1) * (view_.block_columns + 1), 0);
    view_.occupied = occupied_.data();
    view_.unit_per_mm = source.storage == storage ? source.unit_per_mm : int16_unit(source);
    storage == kInt16 ? fill<std::int16_t>(source, workers) : fill<float>(source, workers);
}

VolumeLayout::Source VolumeLayout::as_source() const {
    Source source{view_.origin, storage_, view_.unit_per_mm, {}, {}};
    const auto& order = kAxisOrder[axis_];
    const std::ptrdiff_t strides[3] = {view_.plane_stride, view_.row_stride, 1};
    const int sizes[3] = {view_.planes, view_.rows, view_.columns};
    for (int i = 0; i < 3; ++i) {
        source.stride[order[i]] = strides[i];
        source.size[order[i]] = sizes[i];
    }
    return source;
}

template <class To>
void VolumeLayout::fill(const Source& source, Workers& workers) {
    const auto& order = kAxisOrder[axis_];
    const std::ptrdiff_t plane_step = source.stride[order[0]], row_step = source.stride[order[1]],
                         column_step = source.stride[order[2]];
    // view_.origin is the same place, const.
    To* origin =
        static_cast<To*>(voxels_.data()) + (static_cast<const To*>(view_.origin) - static_cast<To*>(voxels_.data()));
    workers.run(view_.planes, [&](std::size_t plane, int) {
        To* to = origin + static_cast<std::ptrdiff_t>(plane) * view_.plane_stride;
        const std::ptrdiff_t from = static_cast<std::ptrdiff_t>(plane) * plane_step;
        if (source.storage == kInt16) {
            copy_plane(to, view_.row_stride, static_cast<const std::int16_t*>(source.voxels) + from, row_step,
                       column_step, view_.rows, view_.columns, 1);
        } else {
            copy_plane(to, view_.row_stride, static_cast<const float*>(source.voxels) + from, row_step, column_step,
                       view_.rows, view_.columns, 1 / view_.unit_per_mm);
        }
    });
    const std::size_t slabs = (view_.planes + kSlabPlanes - 1) / kSlabPlanes;
    workers.run(slabs, [&](std::size_t slab, int) { count_blocks<To>(static_cast<int>(slab)); });
}

template <class To>
void VolumeLayout::count_blocks(int slab) {
    const std::ptrdiff_t stride = view_.block_columns + 1;
    std::int32_t* table = occupied_.data() + slab * stride * (view_.block_rows + 1);
    const int last_plane = std::min((slab + 1) * kSlabPlanes, view_.planes);
    for (int plane = slab * kSlabPlanes; plane < last_plane; ++plane) {
        for (int row = 0; row < view_.rows; ++row) {
            const To* voxels =
                static_cast<const To*>(view_.origin) + plane * view_.plane_stride + row * view_.row_stride;
            std::int32_t* counts = table + (row / kBlockVoxels + 1) * stride + 1;
            for (int column = 0; column < view_.columns; ++column) {
                if (voxels[column] != 0) counts[column / kBlockVoxels] = 1;
            }
        }
    }
    for (int row = 1; row <= view_.block_rows; ++row) {
        for (int column = 1; column <= view_.block_columns; ++column) {
            std::int32_t* entry = table + row * stride + column;
            *entry += entry[-1] + entry[-stride] - entry[-stride - 1];
        }
    }
}

}  // namespace raylign::cpu

#include "backends/cpu/volume_layout.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>

namespace raylign::cpu {
namespace {

constexpr int kSquare = 16;  ///< voxels on a side of what is transposed at once: a cache line of floats

int blocks(int voxels) { return voxels / kBlockVoxels + (voxels % kBlockVoxels != 0 ? 1 : 0); }
std::size_t slabs(int planes) { return (static_cast<std::size_t>(planes) + kSlabPlanes - 1) / kSlabPlanes; }

float largest_of(const float* row, int count) {
    float largest[kSquare] = {};  // as many maxima side by side as make vectors
    int i = 0;
    for (; i + kSquare <= count; i += kSquare) {
        for (int k = 0; k < kSquare; ++k) largest[k] = std::max(largest[k], std::abs(row[i + k]));
    }
    for (; i < count; ++i) largest[0] = std::max(largest[0], std::abs(row[i]));
    return *std::max_element(largest, largest + kSquare);
}

/// The unit of int16 voxels for a source of floats, whose rows along x are contiguous.
float int16_unit(const VolumeLayout::Source& source, Workers& workers) {
    std::vector<float> largest(source.size[2]);
    workers.run(largest.size(), [&](std::size_t z, int) {
        const float* plane =
            static_cast<const float*>(source.voxels) + static_cast<std::ptrdiff_t>(z) * source.stride[2];
        for (int y = 0; y < source.size[1]; ++y) {
            largest[z] = std::max(largest[z], largest_of(plane + y * source.stride[1], source.size[0]));
        }
    });
    const float maximum = *std::ranges::max_element(largest);
    return maximum > 0 ? maximum / 32767 : 1;
}

template <class To, class From>
void copy_row(To* to, const From* from, int count, float per_unit) {
    if constexpr (std::is_same_v<To, From>) {
        std::copy_n(from, count, to);
    } else {
        // Adding 1.5 * 2^23 leaves no bits for the fraction: rounds to the nearest like lrint, but as vectors.
        constexpr float kNoFraction = 12582912;
        for (int i = 0; i < count; ++i) to[i] = static_cast<To>(from[i] * per_unit + kNoFraction - kNoFraction);
    }
}

/// to[i * to_step + k] = from[i + k * from_step] for i < rows and k < columns, both at most kSquare: whole lines are
/// read and written, so that no line is fetched twice. `Count` is int, or a constant for faster code.
template <class To, class From, class Count>
void transpose_square(To* to, std::ptrdiff_t to_step, const From* from, std::ptrdiff_t from_step, Count rows,
                      Count columns, float per_unit) {
    From square[kSquare][kSquare];
    // The lines are further apart than the processor foresees.
    for (int k = 0; k < columns; ++k) __builtin_prefetch(from + (k + kSquare) * from_step);
    for (int k = 0; k < columns; ++k) {
        for (int i = 0; i < rows; ++i) square[i][k] = from[i + k * from_step];
    }
    for (int i = 0; i < rows; ++i) copy_row(to + i * to_step, square[i], columns, per_unit);
}

/// The same for any number of columns.
template <class To, class From>
void transpose(To* to, std::ptrdiff_t to_step, const From* from, std::ptrdiff_t from_step, int rows, int columns,
               float per_unit) {
    using Whole = std::integral_constant<int, kSquare>;
    for (int column = 0; column < columns; column += kSquare, to += kSquare, from += kSquare * from_step) {
        const int width = std::min(kSquare, columns - column);
        if (rows == kSquare && width == kSquare) {
            transpose_square(to, to_step, from, from_step, Whole{}, Whole{}, per_unit);
        } else {
            transpose_square(to, to_step, from, from_step, rows, width, per_unit);
        }
    }
}

}  // namespace

VolumeLayout::VolumeLayout(const Source& source, int axis, VoxelStorage storage, Workers& workers)
    : axis_(axis), storage_(storage) {
    set_sizes(source);
    const std::size_t voxel_bytes = storage == kInt16 ? sizeof(std::int16_t) : sizeof(float);
    // In floating point: absurd sizes must not wrap around to small ones.
    const double bytes = static_cast<double>(view_.plane_stride) * (view_.planes + 3.0) * voxel_bytes;
    voxels_ = PageBuffer(bytes < 0x1p62 ? static_cast<std::size_t>(bytes) : SIZE_MAX, "the engine's volume");
    const std::ptrdiff_t first = view_.plane_stride + kPadVoxels * view_.row_stride + kPadVoxels;
    view_.origin = static_cast<const char*>(voxels_.data()) + first * voxel_bytes;
    occupied_.assign(slabs(view_.planes) * (view_.block_rows + 1) * (view_.block_columns + 1), 0);
    view_.occupied = occupied_.data();
    if (source.storage == kInt16) {
        view_.unit_per_mm = source.unit_per_mm;
        fill<std::int16_t, std::int16_t>(source, workers);
    } else if (storage == kInt16) {
        view_.unit_per_mm = int16_unit(source, workers);
        fill<std::int16_t, float>(source, workers);
    } else {
        view_.unit_per_mm = source.unit_per_mm;
        fill<float, float>(source, workers);
    }
}

void VolumeLayout::set_sizes(const Source& source) {
    const auto& order = kAxisOrder[axis_];
    view_.planes = source.size[order[0]];
    view_.rows = source.size[order[1]];
    view_.columns = source.size[order[2]];
    view_.block_rows = blocks(view_.rows);
    view_.block_columns = blocks(view_.columns);
    // Rows start on a cache line; an odd number of lines apart, so that the rows of a footprint fall into different
    // sets.
    const std::ptrdiff_t line = storage_ == kInt16 ? 32 : 16, padded = std::ptrdiff_t{view_.columns} + 2 * kPadVoxels;
    view_.row_stride = ((padded + line - 1) / line | 1) * line;
    view_.plane_stride = view_.row_stride * (std::ptrdiff_t{view_.rows} + 2 * kPadVoxels);
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
To* VolumeLayout::row(int plane, int row) {
    To* const begin = static_cast<To*>(voxels_.data());
    return begin + (std::ptrdiff_t{plane} + 1) * view_.plane_stride +
           (std::ptrdiff_t{row} + kPadVoxels) * view_.row_stride + kPadVoxels;
}

std::int32_t* VolumeLayout::occupied(std::size_t slab) {
    return occupied_.data() + slab * (view_.block_rows + 1) * (view_.block_columns + 1);
}

/// Part by part, so that the voxels are still in the L2 when the occupied blocks are looked for.
template <class To, class From>
void VolumeLayout::fill(const Source& source, Workers& workers) {
    workers.run(slabs(view_.planes), [&](std::size_t slab, int) {
        const int plane = static_cast<int>(slab) * kSlabPlanes;
        for (int row = 0; row < view_.rows; row += std::min(kSquare, view_.rows - row)) {
            const Part part{plane, plane + std::min(kSlabPlanes, view_.planes - plane), row,
                            row + std::min(kSquare, view_.rows - row)};
            copy_part<To, From>(source, part);
            find_occupied<To>(part);
        }
        sum_occupied(slab);
    });
}

template <class To, class From>
void VolumeLayout::copy_part(const Source& source, const Part& part) {
    static_assert(kSlabPlanes <= kSquare);
    const auto& order = kAxisOrder[axis_];
    const std::ptrdiff_t plane_step = source.stride[order[0]], row_step = source.stride[order[1]],
                         column_step = source.stride[order[2]];
    const float per_unit = 1 / view_.unit_per_mm;
    const From* const from = static_cast<const From*>(source.voxels) + part.plane0 * plane_step + part.row0 * row_step;
    const int planes = part.plane1 - part.plane0, rows = part.row1 - part.row0;
    if (column_step == 1) {
        for (int i = 0; i < planes * rows; ++i) {
            const int plane = i / rows, row = i % rows;
            copy_row(this->row<To>(part.plane0 + plane, part.row0 + row), from + plane * plane_step + row * row_step,
                     view_.columns, per_unit);
        }
        return;
    }
    // The axis that is contiguous in the source is across the planes, or along the rows of each plane.
    const bool across = plane_step == 1;
    for (int i = 0; i < (across ? rows : planes); ++i) {
        To* const to = across ? row<To>(part.plane0, part.row0 + i) : row<To>(part.plane0 + i, part.row0);
        transpose(to, across ? view_.plane_stride : view_.row_stride, from + i * (across ? row_step : plane_step),
                  column_step, across ? planes : rows, view_.columns, per_unit);
    }
}

/// Marks the blocks of a part that hold a voxel other than 0. The zeros behind a row fill up its last block.
template <class To>
void VolumeLayout::find_occupied(const Part& part) {
    static_assert(kPadVoxels >= kBlockVoxels);
    const std::ptrdiff_t stride = view_.block_columns + 1;
    for (int plane = part.plane0; plane < part.plane1; ++plane) {
        for (int row = part.row0; row < part.row1; ++row) {
            const To* voxels = this->row<To>(plane, row);
            std::int32_t* marks = occupied(plane / kSlabPlanes) + (row / kBlockVoxels + 1) * stride + 1;
            for (int block = 0; block < view_.block_columns; ++block, voxels += kBlockVoxels) {
                int any = 0;
                for (int k = 0; k < kBlockVoxels; ++k) any |= voxels[k] != 0;
                marks[block] |= any;
            }
        }
    }
}

/// Marks to sums over all blocks above and to the left.
void VolumeLayout::sum_occupied(std::size_t slab) {
    const std::ptrdiff_t stride = view_.block_columns + 1;
    for (int row = 1; row <= view_.block_rows; ++row) {
        for (int column = 1; column <= view_.block_columns; ++column) {
            std::int32_t* entry = occupied(slab) + row * stride + column;
            *entry += entry[-1] + entry[-stride] - entry[-stride - 1];
        }
    }
}

}  // namespace raylign::cpu

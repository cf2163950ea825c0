#include "backends/cpu/volume_copy.h"

#include <algorithm>
#include <type_traits>
#include <vector>

namespace raylign::detail::cpu {
namespace {

constexpr int kSquare = 16;  ///< voxels on a side of what is transposed at once: a cache line of floats
static_assert(kSquare == 2 * kBlockVoxels);

std::size_t voxel_bytes(VoxelStorage storage) { return storage == kInt16 ? sizeof(std::int16_t) : sizeof(float); }

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

struct Strides {
    std::ptrdiff_t middle, slow;
};

/// Rows start on a cache line (5 % faster than anywhere). Rows, and planes of them, are an odd number of lines apart,
/// so that those of a footprint fall into different sets of the cache. The zeros behind a row are those before the
/// next.
Strides strides(const BrickMap& map, const MemoryOrder& order, VoxelStorage storage) {
    const std::ptrdiff_t line = 64 / static_cast<std::ptrdiff_t>(voxel_bytes(storage));
    const std::ptrdiff_t row = std::ptrdiff_t{map.end[order.fast]} - map.begin[order.fast] + kPadVoxels;
    const std::ptrdiff_t rows = std::ptrdiff_t{map.end[order.middle]} - map.begin[order.middle] + kPadVoxels;
    const std::ptrdiff_t middle = ((row + line - 1) / line | 1) * line;
    return {middle, middle * (rows | 1)};
}

/// The bricks [begin, end) that hold something, of one line of bricks.
struct Run {
    int begin, end;
};

/// What is occupied along the fast axis, of `width` neighbouring lines in the direction `across`.
Run occupied_run(const BrickMap& map, const MemoryOrder& order, int slow, int middle, int across, int width) {
    Run run{map.bricks[order.fast], 0};
    int at[3];
    at[order.slow] = slow;
    at[order.middle] = middle;
    for (int i = 0; i < width && at[across] < map.bricks[across]; ++i, ++at[across]) {
        for (int k = 0; k < map.bricks[order.fast]; ++k) {
            at[order.fast] = k;
            if (!map.occupied[map.index(at[0], at[1], at[2])]) continue;
            run.begin = std::min(run.begin, k);
            run.end = std::max(run.end, k + 1);
        }
    }
    return run;
}

}  // namespace

double VolumeCopy::span_bytes(const BrickMap& map, const MemoryOrder& order, VoxelStorage storage) {
    const auto padded = [&](int axis) { return static_cast<double>(map.end[axis]) - map.begin[axis] + 2 * kPadVoxels; };
    return padded(order.slow) * padded(order.middle) * padded(order.fast) * static_cast<double>(voxel_bytes(storage));
}

VolumeCopy::VolumeCopy(const VoxelSource& source, const BrickMap& map, const MemoryOrder& order, VoxelStorage storage,
                       float unit_per_mm, Workers& workers)
    : order_(order), storage_(storage), unit_per_mm_(unit_per_mm) {
    std::copy_n(map.voxels, 3, voxels_);
    std::copy_n(map.begin, 3, begin_);
    std::copy_n(map.end, 3, end_);
    const Strides strides = cpu::strides(map, order, storage);
    stride_[order.slow] = strides.slow;
    stride_[order.middle] = strides.middle;
    stride_[order.fast] = 1;
    const std::ptrdiff_t planes =
        std::ptrdiff_t{end_[order.slow]} - begin_[order.slow] + std::ptrdiff_t{2} * kPadVoxels + 1;
    first_ = kPadVoxels * (strides.slow + strides.middle) + 64 / static_cast<std::ptrdiff_t>(voxel_bytes(storage));
    buffer_ =
        PageBuffer(static_cast<std::size_t>(planes) * strides.slow * voxel_bytes(storage), "the backend's volume");
    count_pages(map);
    if (storage == kFloat32) {
        fill<float, float>(source, map, workers);
    } else if (source.storage == kFloat32) {
        fill<std::int16_t, float>(source, map, workers);
    } else {
        fill<std::int16_t, std::int16_t>(source, map, workers);
    }
}

std::ptrdiff_t VolumeCopy::offset(int slow, int middle, int fast) const {
    return first_ + (slow - begin_[order_.slow]) * stride_[order_.slow] +
           (middle - begin_[order_.middle]) * stride_[order_.middle] + (fast - begin_[order_.fast]);
}

template <class To>
To* VolumeCopy::at(int slow, int middle, int fast) const {
    return static_cast<To*>(buffer_.data()) + offset(slow, middle, fast);
}

PlaneLayout VolumeCopy::view(int axis) const {
    PlaneLayout view{};
    const auto& order = kAxisOrder[axis];
    view.origin = static_cast<const char*>(buffer_.data()) + first_ * voxel_bytes(storage_);
    view.unit_per_mm = unit_per_mm_;
    view.plane_stride = stride_[order[0]];
    view.row_stride = stride_[order[1]];
    view.planes = voxels_[order[0]];
    view.rows = voxels_[order[1]];
    view.columns = voxels_[order[2]];
    for (int i = 0; i < 3; ++i) {
        view.begin[i] = begin_[order[i]];
        view.end[i] = end_[order[i]];
    }
    return view;
}

VoxelSource VolumeCopy::as_source() const {
    VoxelSource source{static_cast<const char*>(buffer_.data()) + first_ * voxel_bytes(storage_),
                       storage_,
                       unit_per_mm_,
                       {stride_[0], stride_[1], stride_[2]},
                       {},
                       {}};
    std::copy_n(begin_, 3, source.begin);
    std::copy_n(end_, 3, source.end);
    return source;
}

template <class To, class From>
void VolumeCopy::fill(const VoxelSource& source, const BrickMap& map, Workers& workers) {
    const int slabs = (map.bricks[order_.slow] + 1) / 2;
    workers.run(slabs, [&](std::size_t slab, int) {
        const int brick = 2 * static_cast<int>(slab);
        source.stride[order_.fast] == 1 ? fill_rows<To, From>(source, map, brick)
                                        : fill_across<To, From>(source, map, brick);
    });
}

template <class From>
const From* source_at(const VoxelSource& source, const MemoryOrder& order, int slow, int middle, int fast) {
    return static_cast<const From*>(source.voxels) + (slow - source.begin[order.slow]) * source.stride[order.slow] +
           (middle - source.begin[order.middle]) * source.stride[order.middle] +
           (fast - source.begin[order.fast]) * source.stride[order.fast];
}

/// Fills two layers of bricks, where source and copy have the same fast axis.
template <class To, class From>
void VolumeCopy::fill_rows(const VoxelSource& source, const BrickMap& map, int slow_brick) {
    const int last_brick = std::min(slow_brick + 2, map.bricks[order_.slow]);
    for (int slow = slow_brick * kBlockVoxels; slow < std::min(last_brick * kBlockVoxels, end_[order_.slow]); ++slow) {
        for (int middle_brick = 0; middle_brick < map.bricks[order_.middle]; ++middle_brick) {
            const Run run = occupied_run(map, order_, slow / kBlockVoxels, middle_brick, order_.slow, 1);
            if (run.begin >= run.end) continue;
            const int fast = run.begin * kBlockVoxels,
                      count = std::min(run.end * kBlockVoxels, end_[order_.fast]) - fast;
            const int last = std::min((middle_brick + 1) * kBlockVoxels, end_[order_.middle]);
            for (int middle = middle_brick * kBlockVoxels; middle < last; ++middle) {
                copy_row(at<To>(slow, middle, fast), source_at<From>(source, order_, slow, middle, fast), count,
                         1 / unit_per_mm_);
            }
        }
    }
}

/// The same where the source's fast axis is another: squares of it and of the copy's fast axis are transposed.
template <class To, class From>
void VolumeCopy::fill_across(const VoxelSource& source, const BrickMap& map, int slow_brick) {
    const bool slow_is_fast_in_source = source.stride[order_.slow] == 1;
    const int slow0 = slow_brick * kBlockVoxels, slow1 = std::min(slow0 + kSquare, end_[order_.slow]);
    if (slow0 >= slow1) return;
    const int across = slow_is_fast_in_source ? order_.slow : order_.middle;
    const int step = slow_is_fast_in_source ? 1 : kSquare;  // middle rows at once
    for (int middle = 0; middle < end_[order_.middle]; middle += step) {
        const int rows = std::min(step, end_[order_.middle] - middle);
        for (int slow = slow0; slow < slow1; slow += slow_is_fast_in_source ? kSquare : 1) {
            const Run run = occupied_run(map, order_, slow / kBlockVoxels, middle / kBlockVoxels, across, 2);
            if (run.begin >= run.end) continue;
            const int fast = run.begin * kBlockVoxels,
                      count = std::min(run.end * kBlockVoxels, end_[order_.fast]) - fast;
            transpose(at<To>(slow, middle, fast), stride_[across], source_at<From>(source, order_, slow, middle, fast),
                      source.stride[order_.fast], slow_is_fast_in_source ? slow1 - slow0 : rows, count,
                      1 / unit_per_mm_);
        }
    }
}

/// Rows of a line of bricks follow each other: its first voxel and its last are the ends of what is written.
void VolumeCopy::count_pages(const BrickMap& map) {
    constexpr std::size_t kPage = PageBuffer::kPageBytes;
    const std::size_t size = voxel_bytes(storage_);
    std::vector<bool> touched(buffer_.bytes() / kPage + 1);
    for (int slow = begin_[order_.slow]; slow < end_[order_.slow]; ++slow) {
        for (int brick = begin_[order_.middle] / kBlockVoxels; brick < map.bricks[order_.middle]; ++brick) {
            const Run run = occupied_run(map, order_, slow / kBlockVoxels, brick, order_.slow, 1);
            if (run.begin >= run.end) continue;
            const int last_row = std::min((brick + 1) * kBlockVoxels, end_[order_.middle]) - 1;
            const int last = std::min(run.end * kBlockVoxels, end_[order_.fast]) - 1;
            std::size_t page = offset(slow, brick * kBlockVoxels, run.begin * kBlockVoxels) * size / kPage;
            for (; page <= offset(slow, last_row, last) * size / kPage; ++page) touched[page] = true;
        }
    }
    bytes_ = std::min<std::size_t>(std::ranges::count(touched, true) * kPage, buffer_.bytes());
}

}  // namespace raylign::detail::cpu

#pragma once

#include <cstddef>
#include <cstdint>

#include "backends/cpu/brick_map.h"
#include "backends/cpu/kernel_types.h"
#include "backends/cpu/page_buffer.h"
#include "backends/cpu/workers.h"

namespace raylign::detail::cpu {

/// A strided view of voxels, in x, y, z order. Those outside [begin, end) are zeros that are not there.
struct VoxelSource {
    const void* voxels;  ///< voxel `begin`, of type `storage`
    VoxelStorage storage;
    float unit_per_mm;  ///< attenuation that a stored 1 stands for
    std::ptrdiff_t stride[3];
    int begin[3], end[3];
};

/// Which index axis is the slowest in memory, which is in the middle, and along which voxels are neighbours.
struct MemoryOrder {
    int slow, middle, fast;
};

/// A copy of the occupied box of a volume, with kPadVoxels zeros around it on all sides. Empty bricks are not written,
/// and where a whole page (2 MiB) holds nothing else, the system never gives memory for it.
class VolumeCopy {
public:
    /// span_bytes must be below 2^62. Throws Error where so much memory is not free.
    VolumeCopy(const VoxelSource& source, const BrickMap& map, const MemoryOrder& order, VoxelStorage storage,
               float unit_per_mm, Workers& workers);

    /// The copy as planes across `axis`, which must not be the fast one. The tables of occupied blocks are left to the
    /// caller.
    [[nodiscard]] PlaneLayout view(int axis) const;
    /// Its voxels, to make another copy from.
    [[nodiscard]] VoxelSource as_source() const;
    /// Memory that its pages take, once written.
    [[nodiscard]] std::size_t bytes() const { return bytes_; }

    /// The memory that a copy would span, empty bricks included. A double: absurd sizes must not wrap around.
    [[nodiscard]] static double span_bytes(const BrickMap& map, const MemoryOrder& order, VoxelStorage storage);

private:
    template <class To, class From>
    void fill(const VoxelSource& source, const BrickMap& map, Workers& workers);
    template <class To, class From>
    void fill_rows(const VoxelSource& source, const BrickMap& map, int slow_brick);
    template <class To, class From>
    void fill_across(const VoxelSource& source, const BrickMap& map, int slow_brick);
    /// In voxels from the buffer's begin.
    [[nodiscard]] std::ptrdiff_t offset(int slow, int middle, int fast) const;
    template <class To>
    [[nodiscard]] To* at(int slow, int middle, int fast) const;
    void count_pages(const BrickMap& map);

    MemoryOrder order_;
    VoxelStorage storage_;
    float unit_per_mm_;
    std::ptrdiff_t stride_[3];  ///< by index axis
    std::ptrdiff_t first_;      ///< of voxel `begin` in the buffer
    int voxels_[3], begin_[3], end_[3];
    PageBuffer buffer_;
    std::size_t bytes_ = 0;
};

}  // namespace raylign::detail::cpu

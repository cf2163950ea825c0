#pragma once

#include <cstdint>
#include <vector>

#include "backends/cpu/kernel_types.h"
#include "backends/cpu/page_buffer.h"
#include "backends/cpu/workers.h"
#include "core/image/volume.h"

namespace raylign::cpu {

/// The volume as planes along one axis (see PlaneLayout), and which parts of it are empty.
class VolumeLayout {
public:
    /// A strided view of voxels to copy from, in x, y, z order.
    struct Source {
        const void* voxels;  ///< of type `storage`
        VoxelStorage storage;
        float unit_per_mm;  ///< attenuation that a stored 1 stands for
        std::ptrdiff_t stride[3];
        int size[3];
    };
    /// int16 voxels are multiples of a unit, max |attenuation| / 32767: off by half a unit at most, and 0 stays 0. So
    /// the integral along L mm of volume is off by L max |attenuation| / 65534 at most. An int16 source is copied as it
    /// is.
    VolumeLayout(const Source& source, int axis, VoxelStorage storage, Workers& workers);

    [[nodiscard]] PlaneLayout view() const { return view_; }
    /// Its voxels, to make another layout from.
    [[nodiscard]] Source as_source() const;
    [[nodiscard]] std::size_t bytes() const { return voxels_.bytes() + occupied_.size() * sizeof(std::int32_t); }

private:
    /// The rows [row0, row1) of the planes [plane0, plane1) of one slab.
    struct Part {
        int plane0, plane1, row0, row1;
    };
    void set_sizes(const Source& source);
    template <class To, class From>
    void fill(const Source& source, Workers& workers);
    template <class To, class From>
    void copy_part(const Source& source, const Part& part);
    template <class To>
    void find_occupied(const Part& part);
    void sum_occupied(std::size_t slab);
    template <class To>
    [[nodiscard]] To* row(int plane, int row);
    [[nodiscard]] std::int32_t* occupied(std::size_t slab);

    int axis_;
    VoxelStorage storage_;
    PageBuffer voxels_;
    std::vector<std::int32_t> occupied_;
    PlaneLayout view_{};
};

}  // namespace raylign::cpu

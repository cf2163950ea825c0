#pragma once

#include "backends/cpu/lanes.h"

namespace raylign::detail::cpu {
namespace {

/// What a kernel sums along rays: values only, or the slopes that pose derivatives need as well.
enum class Order { value, derivatives };

/// What a footprint (below) wants to know of a packet's rays once, not in each slab: nothing, unless it says so.
template <class Arch>
struct FootprintLines {
    template <class Packet>
    void set(const Packet&, bool /*planes_follow*/) {}
};

/// The rays of a packet that step along one axis, as lines over the planes of that axis. At signed distance d (in
/// planes) from the source, lane i is at row source + d * (row_line + row_offset[i]), and likewise its column. Offsets
/// are small, so that float holds them to 1e-6 of a voxel wherever the source is; the common line is double.
template <class Set>
struct alignas(64) JosephPacket {
    using Arch = Set;
    static constexpr int count = Lanes<Arch>::count;
    float row_offset[count], row_slope[count], column_offset[count], column_slope[count];  ///< slope = line + offset
    float first_plane[count], last_plane[count];  ///< planes between source and detector, where limited
    float mm_per_plane[count];
    float sum[count];
    float row_gradient[count], column_gradient[count];  ///< sums of the values' slopes, for derivatives
    float row_moment[count], column_moment[count];      ///< the same times the distance in planes from the source
    [[no_unique_address]] FootprintLines<Arch> lines;
    double row_line, column_line;      ///< the lowest row and column of all lanes: d * offset >= 0 unless limited
    double row_spread, column_spread;  ///< the largest |offset|
    int x, y;                          ///< first pixel
    unsigned lanes;                    ///< those that step along this axis
    bool limited;
};

/// Where a packet meets one slab: planes [begin, end), at distances d0 .. d1 from the source.
struct SlabPart {
    int begin, end;
    double d0, d1;
    double row, column;  ///< of the packet's line on plane `begin`
    int row0, column0;   ///< a voxel before all of its samples: floats count from here
};

struct ReadAhead;

/// A way to read a packet's voxels that beats gathers, where the instruction set has one (footprint_avx512.h,
/// footprint_avx2.h, footprint_neon.h).
template <class Arch>
struct Footprint {
    static constexpr VoxelStorage storage = kFloat32;  ///< what it is fastest with
    template <class Voxel, Order order>
    static bool march(const PlaneLayout&, JosephPacket<Arch>&, const SlabPart&, const ReadAhead&) {
        return false;
    }
};

}  // namespace
}  // namespace raylign::detail::cpu

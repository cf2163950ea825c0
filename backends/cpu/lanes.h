#pragma once

// Compiled once per instruction set: everything here is a template on the set or in the anonymous namespace, so that no
// two files share a symbol. No Eigen, no containers.

#include <xsimd/xsimd.hpp>

#include "backends/cpu/kernel_types.h"

namespace raylign::detail::cpu {
namespace {

/// A packet is a small rectangle of pixels, one per vector lane: close rays read close voxels.
template <class Arch>
struct Lanes {
    using Floats = xsimd::batch<float, Arch>;
    using Ints = xsimd::batch<std::int32_t, Arch>;
    static constexpr int count = static_cast<int>(Floats::size);
    static constexpr int width = count >= 8 ? 4 : 2;
    static constexpr int height = count / width;
    static constexpr int packets_per_tile = kTilePx * kTilePx / count;
};

/// a * b + c in one instruction where the set has it (xsimd 8.1 makes two of it for AVX-512: see pairs_avx512.h).
template <class Arch>
struct Fused {
    using Floats = typename Lanes<Arch>::Floats;
    static Floats multiply_add(const Floats& a, const Floats& b, const Floats& c) { return xsimd::fma(a, b, c); }
};
template <class Floats>
Floats fused(const Floats& a, const Floats& b, const Floats& c) {
    return Fused<typename Floats::arch_type>::multiply_add(a, b, c);
}

/// Four doubles that compilers make vectors of for any instruction set; loops from float to double stay scalar. They go
/// by reference: by value, sets without such registers would have another calling convention.
using FourFloats [[gnu::vector_size(4 * sizeof(float))]] = float;
using FourDoubles [[gnu::vector_size(4 * sizeof(double))]] = double;

inline void load_four(const float* from, FourDoubles& to) {
    FourFloats floats;
    __builtin_memcpy(&floats, from, sizeof(floats));
    to = __builtin_convertvector(floats, FourDoubles);
}

/// All numbers in order.
template <int count>
double total_of(const FourDoubles (&parts)[count]) {
    double sum = 0;
    for (const FourDoubles& part : parts) {
        for (int lane = 0; lane < 4; ++lane) sum += part[lane];
    }
    return sum;
}

inline double minimum(double a, double b) { return b < a ? b : a; }
inline double maximum(double a, double b) { return a < b ? b : a; }

/// floor(value) as int, where value may lie far outside the range: it is clamped first.
inline int floor_clamped(double value, int low, int high) {
    if (!(value > low)) return low;
    if (value >= high) return high;
    return static_cast<int>(__builtin_floor(value));
}

/// Directions of the rays of a packet whose first pixel is (x, y), in voxels per mm of depth, and which lanes lie in
/// the tile. Lanes outside the image repeat its last pixels, so that they cost nothing and fault nowhere.
template <int count, int width>
struct PacketRays {
    double ray[3][count];
    unsigned inside = 0;

    PacketRays(const CastJob& job, int x, int y) {
        double u[count], v[count];
        for (int lane = 0; lane < count; ++lane) {
            const int px = x + lane % width, py = y + lane / width;
            if (px < job.x1 && py < job.y1) inside |= 1U << lane;
            u[lane] = px < job.width ? px : job.width - 1;
            v[lane] = py < job.height ? py : job.height - 1;
        }
        for (int axis = 0; axis < 3; ++axis) {
            for (int lane = 0; lane < count; ++lane) {  // the same operations in the same order as RayFrame::ray_voxel
                ray[axis][lane] = job.direction[axis] + u[lane] * job.step_u[axis] + v[lane] * job.step_v[axis];
            }
        }
    }

    /// Lanes in the tile whose dominant axis is `axis`, by the rule of core/geometry/dominant_axis.h, in double: a ray
    /// on the border must fall on the same side as in the reference.
    unsigned lanes_along(int axis, double ratio) const {
        unsigned lanes = 0;
        for (int lane = 0; lane < count; ++lane) {
            const double x = __builtin_fabs(ray[0][lane]), y = __builtin_fabs(ray[1][lane]),
                         z = __builtin_fabs(ray[2][lane]);
            const bool second = y > x * ratio;
            const bool third = z > (second ? y : x) * ratio;
            const int found = third ? 2 : second ? 1 : 0;
            lanes |= static_cast<unsigned>(found == axis) << lane;
        }
        return lanes & inside;
    }

    /// Rays of lanes that are not in `lanes` become copies of one that is.
    void fill_others(unsigned lanes) {
        const int first = __builtin_ctz(lanes);
        for (int lane = 0; lane < count; ++lane) {
            if (lanes >> lane & 1) continue;
            for (auto& component : ray) component[lane] = component[first];
        }
    }
};

inline bool is_needed(const CastJob& job, int x, int y) {
    return !job.needed || job.needed[y / kNeedPx * job.needed_stride + x / kNeedPx];
}

/// Writes a packet's values, one a lane, to its pixels of an image: those of `lanes`.
template <class Packet>
void store_pixels(const Packet& packet, const float* values, float* image, std::ptrdiff_t stride) {
    constexpr int count = Packet::count, width = count >= 8 ? 4 : 2;
    image += packet.y * stride + packet.x;
    for (int row = 0; row < count / width; ++row, image += stride, values += width) {
        const unsigned lanes = packet.lanes >> row * width & ((1U << width) - 1);
        if (lanes == (1U << width) - 1) {
            __builtin_memcpy(image, values, width * sizeof(float));
            continue;
        }
        for (int i = 0; i < width; ++i) {
            if (lanes >> i & 1) image[i] = values[i];
        }
    }
}

/// Where a voxel is, or would be: see PlaneLayout for those that may be read.
template <class Voxel>
const Voxel* voxel_at(const PlaneLayout& layout, int plane, int row, int column) {
    return static_cast<const Voxel*>(layout.origin) + (plane - layout.begin[0]) * layout.plane_stride +
           (row - layout.begin[1]) * layout.row_stride + (column - layout.begin[2]);
}

constexpr double kSlack = 1e-3;  ///< of a voxel: covers the rounding of the floats that address the voxels

/// Rows (or columns) of a plane, both ends included.
struct Range {
    double low, high;
};

/// Rows (or columns) at distances d0 .. d1 from the source that lines with slopes line .. line + spread can meet, or
/// line - spread .. line where d is negative; widened by kSlack.
inline Range line_range(double source, double line, double spread, double d0, double d1) {
    const double reach = spread * maximum(__builtin_fabs(d0), __builtin_fabs(d1));
    return {source + minimum(d0 * line, d1 * line) - kSlack, source + maximum(d0 * line, d1 * line) + reach + kSlack};
}

/// True if a block that touches these rows and columns of a slab holds a non-zero voxel. Slab and ranges are clipped to
/// the volume here.
inline bool is_occupied(const PlaneLayout& layout, int slab, const Range& rows, const Range& columns) {
    if (slab < 0 || slab * kSlabPlanes >= layout.planes) return false;
    if (!(rows.high > -1 && rows.low < layout.rows && columns.high > -1 && columns.low < layout.columns)) return false;
    const int r0 = floor_clamped(rows.low, 0, layout.rows - 1) / kBlockVoxels;
    const int r1 = floor_clamped(rows.high + 1, 0, layout.rows - 1) / kBlockVoxels + 1;
    const int c0 = floor_clamped(columns.low, 0, layout.columns - 1) / kBlockVoxels;
    const int c1 = floor_clamped(columns.high + 1, 0, layout.columns - 1) / kBlockVoxels + 1;
    const std::ptrdiff_t stride = layout.block_columns + 1;
    const std::int32_t* table = layout.occupied + slab * stride * (layout.block_rows + 1);
    return table[r1 * stride + c1] - table[r0 * stride + c1] - table[r1 * stride + c0] + table[r0 * stride + c0] > 0;
}

}  // namespace
}  // namespace raylign::detail::cpu

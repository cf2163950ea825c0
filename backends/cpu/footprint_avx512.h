#pragma once

#include <immintrin.h>

#include "backends/cpu/joseph_derivatives.h"
#include "backends/cpu/joseph_tile.h"

namespace raylign::detail::cpu {
namespace {

/// Two rows of eight voxels.
struct FootprintRows {
    static __m512 load(const float* voxels, std::ptrdiff_t distance) {
        return _mm512_insertf32x8(_mm512_castps256_ps512(_mm256_loadu_ps(voxels)), _mm256_loadu_ps(voxels + distance),
                                  1);
    }
    static __m512 load(const std::int16_t* voxels, std::ptrdiff_t distance) {
        const __m128i a = _mm_loadu_si128(reinterpret_cast<const __m128i*>(voxels));
        const __m128i b = _mm_loadu_si128(reinterpret_cast<const __m128i*>(voxels + distance));
        return _mm512_cvtepi32_ps(_mm512_cvtepi16_epi32(_mm256_inserti128_si256(_mm256_castsi128_si256(a), b, 1)));
    }
};

/// Bilinear samples without gathers. A packet of 4x4 rays meets at most 8x8 voxels of a plane when its pixels are about
/// a voxel apart: eight plain loads bring them into four registers, and in-register permutes take the place of four
/// gathers.
///
/// Even rows of the footprint form one table and odd rows another, 32 voxels each. Between two rows one is even and one
/// is odd, so a sample takes one pair from each table, and its weight for the odd row is the distance from the even
/// one, whichever lies above: two permutes a table and no choice between tables.
template <>
struct Footprint<xsimd::avx512bw> {
    using Packet = JosephPacket<xsimd::avx512bw>;
    /// Twice the voxels in each cache line outweigh their conversion (bench/README.md, Memory).
    static constexpr VoxelStorage storage = kInt16;

    /// Adds the planes of a slab to the packet's sums; false, with nothing done, where the footprint is too large.
    template <class Voxel, Order order>
    static bool march(const PlaneLayout& layout, Packet& packet, const SlabPart& part, const ReadAhead& ahead) {
        // Rows first .. first + 6 may start a pair; the base lies up to 1e-3 below the lowest sample.
        const double distance = maximum(__builtin_fabs(part.d0), __builtin_fabs(part.d1));
        if (packet.row_spread * distance > 5.99 || packet.column_spread * distance > 5.99) return false;

        alignas(64) std::int32_t offset[kSlabPlanes];
        alignas(64) float half_row0[kSlabPlanes], index_base[kSlabPlanes];
        place(layout, packet, part, offset, half_row0, index_base);

        const __m512 d0 = _mm512_set1_ps(static_cast<float>(part.d0)), half = _mm512_set1_ps(0.5F),
                     eight = _mm512_set1_ps(8);
        const __m512 row =
            _mm512_mul_ps(half, _mm512_fmadd_ps(d0, _mm512_load_ps(packet.row_offset),
                                                _mm512_set1_ps(static_cast<float>(part.row - part.row0))));
        const __m512 row_slope = _mm512_mul_ps(half, _mm512_load_ps(packet.row_slope));
        const __m512 column = _mm512_fmadd_ps(d0, _mm512_load_ps(packet.column_offset),
                                              _mm512_set1_ps(static_cast<float>(part.column - part.column0)));
        const __m512 column_slope = _mm512_load_ps(packet.column_slope);
        const __m512i one = _mm512_set1_epi32(1);
        const std::ptrdiff_t stride = layout.row_stride;
        const Voxel* plane = voxel_at<Voxel>(layout, part.begin, part.row0, part.column0);
        __m512 even_sum = _mm512_setzero_ps(), odd_sum = _mm512_setzero_ps();
        SlopeSums<xsimd::batch<float, xsimd::avx512bw>> slopes;
        for (int k = 0; k < part.end - part.begin; ++k, plane += layout.plane_stride) {
            ahead.on_plane(k);
            const Voxel* voxels = plane + offset[k];
            const __m512 even0 = FootprintRows::load(voxels, 2 * stride),
                         even1 = FootprintRows::load(voxels + 4 * stride, 2 * stride);
            const __m512 odd0 = FootprintRows::load(voxels + stride, 2 * stride),
                         odd1 = FootprintRows::load(voxels + 5 * stride, 2 * stride);
            const __m512 step = _mm512_set1_ps(kSteps[k]);
            const __m512 r = _mm512_sub_ps(_mm512_fmadd_ps(step, row_slope, row), _mm512_set1_ps(half_row0[k]));
            const __m512 c = _mm512_fmadd_ps(step, column_slope, column);
            const __m512 even_row = _mm512_roundscale_ps(r, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);
            const __m512 odd_row = _mm512_roundscale_ps(r, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
            const __m512 c0 = _mm512_roundscale_ps(c, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
            const __m512 cell = _mm512_add_ps(c0, _mm512_set1_ps(index_base[k]));
            const __m512i even = _mm512_castps_si512(_mm512_fmadd_ps(eight, even_row, cell));
            const __m512i odd = _mm512_castps_si512(_mm512_fmadd_ps(eight, odd_row, cell));
            const __m512 fc = _mm512_sub_ps(c, c0);
            const Pair e(even0, even1, even, one), o(odd0, odd1, odd, one);
            const __m512 e_value = e.value(fc), rise = _mm512_sub_ps(o.value(fc), e_value);
            const __m512 above = _mm512_sub_ps(r, even_row), distance_from_even = _mm512_abs_ps(above);
            even_sum = _mm512_add_ps(even_sum, e_value);
            odd_sum = _mm512_fmadd_ps(distance_from_even, rise, odd_sum);
            if constexpr (order == Order::derivatives) {
                // Downwards from the even row the slope is the other way round; half rows count double.
                const __m512 sign = _mm512_and_ps(above, _mm512_set1_ps(-0.F));
                const __m512 along = _mm512_fmadd_ps(_mm512_add_ps(distance_from_even, distance_from_even),
                                                     _mm512_sub_ps(o.rise, e.rise), e.rise);
                slopes.add(_mm512_xor_ps(rise, sign), along, step);
            }
        }
        // The distance from the even row was counted in steps of two rows.
        const __m512 sum = _mm512_fmadd_ps(_mm512_set1_ps(2), odd_sum, even_sum);
        _mm512_store_ps(packet.sum, _mm512_add_ps(_mm512_load_ps(packet.sum), sum));
        if constexpr (order == Order::derivatives) slopes.store(packet, d0);
        return true;
    }

private:
    /// From memory a number reaches all lanes for free; converting k takes two instructions.
    static constexpr float kSteps[kSlabPlanes] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};

    /// Adding an integer of up to 2^21 to this float leaves the integer in the low bits, where permutes look for it.
    static constexpr float kIntegerBits = 12582912;  // 1.5 * 2^23

    /// Columns `index` and `index` + 1 of a table of four rows of eight.
    struct Pair {
        __m512 first, rise;

        Pair(__m512 table0, __m512 table1, __m512i index, __m512i one)
            : first(_mm512_permutex2var_ps(table0, index, table1)),
              rise(_mm512_sub_ps(_mm512_permutex2var_ps(table0, _mm512_add_epi32(index, one), table1), first)) {}
        [[nodiscard]] __m512 value(__m512 fraction) const { return _mm512_fmadd_ps(fraction, rise, first); }
    };

    /// For all planes of the slab at once (one a lane): where the footprint starts in memory, relative to voxel (row0,
    /// column0); half its first row; what to add to a sample's 8 * half row + column to get its place in the tables.
    /// The footprint is clamped to the padding: there all is zero, and any place will do.
    static void place(const PlaneLayout& layout, const Packet& packet, const SlabPart& part, std::int32_t* offset,
                      float* half_row0, float* index_base) {
        const __m512 k = _mm512_loadu_ps(kSteps);
        const auto first = [&](double start, double line, int origin, int begin, int end) {
            const __m512 low = _mm512_fmadd_ps(k, _mm512_set1_ps(static_cast<float>(line)),
                                               _mm512_set1_ps(static_cast<float>(start - origin - 1e-3)));
            const __m512 floor = _mm512_roundscale_ps(low, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
            return _mm512_min_ps(_mm512_max_ps(floor, _mm512_set1_ps(static_cast<float>(begin - kPadVoxels - origin))),
                                 _mm512_set1_ps(static_cast<float>(end - origin)));
        };
        const __m512 row = first(part.row, packet.row_line, part.row0, layout.begin[1], layout.end[1]);
        const __m512 column = first(part.column, packet.column_line, part.column0, layout.begin[2], layout.end[2]);
        const __m512i stride = _mm512_set1_epi32(static_cast<std::int32_t>(layout.row_stride));
        _mm512_store_si512(offset, _mm512_add_epi32(_mm512_mullo_epi32(_mm512_cvttps_epi32(row), stride),
                                                    _mm512_cvttps_epi32(column)));
        _mm512_store_ps(half_row0, _mm512_mul_ps(_mm512_set1_ps(0.5F), row));
        _mm512_store_ps(index_base, _mm512_sub_ps(_mm512_set1_ps(kIntegerBits), column));
    }
};

}  // namespace
}  // namespace raylign::detail::cpu

#pragma once

#include <immintrin.h>

#include "backends/cpu/footprint_avx512.h"
#include "backends/cpu/trilinear_packet.h"

namespace raylign::detail::cpu {
namespace {

/// Trilinear samples without gathers. Between two planes, a packet's samples meet at most 8x8 voxels of each: plain
/// loads bring both footprints, permutes pick from them (see Footprint), one for each corner of the lower plane and one
/// for the rise to the upper one. Each lane takes the samples that it has there, two or three at steps of half a voxel.
template <>
struct TrilinearFootprint<xsimd::avx512bw> {
    using Packet = TrilinearPacket<xsimd::avx512bw>;
    static constexpr bool available = true;
    static constexpr int most_parts = 4;

    /// Pixels far apart or steep rays have a larger footprint: then halves or quarters of the packet go one after the
    /// other.
    static int split(const PlaneLayout& layout, const double* source, Packet* packets) {
        constexpr unsigned kAll = 0xFFFF,
                           kParts[][4] = {{kAll}, {0x3333, 0xCCCC}, {0x00FF, 0xFF00}, {0x0033, 0x00CC, 0x3300, 0xCC00}};
        constexpr int kCounts[] = {1, 2, 2, 4};
        const double distance =
            maximum(__builtin_fabs(layout.begin[0] - 1 - source[0]), __builtin_fabs(layout.end[0] - source[0]));
        double rows[16], columns[16];
        unsigned forward = 0, backward = 0;
        for (int i = 0; i < 16; ++i) {
            rows[i] = packets->step[1][i] / packets->step[0][i];
            columns[i] = packets->step[2][i] / packets->step[0][i];
            forward |= static_cast<unsigned>(packets->step[0][i] > 0) << i;
            backward |= static_cast<unsigned>(packets->step[0][i] < 0) << i;
        }
        if (forward != kAll && backward != kAll) return 0;
        for (int way = 0; way < 4; ++way) {
            Line row[4], column[4];
            int fits = 0;
            for (; fits < kCounts[way]; ++fits) {
                row[fits] = Line(rows, kParts[way][fits], forward != 0);
                column[fits] = Line(columns, kParts[way][fits], forward != 0);
                if (!(row[fits].reach(distance) < 5.99 && column[fits].reach(distance) < 5.99)) break;
            }
            if (fits < kCounts[way]) continue;
            const unsigned inside = packets->lanes;
            for (int i = 0; i < fits; ++i) {
                if (i > 0) packets[i] = packets[0];
                packets[i].row_line = row[i].slope;
                packets[i].row_spread = row[i].spread;
                packets[i].column_line = column[i].slope;
                packets[i].column_spread = column[i].spread;
                packets[i].lanes = inside & kParts[way][i];
            }
            return fits;
        }
        return 0;
    }

    /// Adds the samples between the planes of a part to the packet's sums.
    template <class Voxel, Order order>
    static void march(const PlaneLayout& layout, Packet& packet, const SlabPart& part) {
        const Samples samples(packet, part);
        if (!samples.some) return;
        alignas(64) std::int32_t row_offset[kSlabPlanes], column_offset[kSlabPlanes];
        alignas(64) float first_row[kSlabPlanes], first_column[kSlabPlanes];
        place(part.row, packet.row_line, part.row0, layout.begin[1], layout.end[1], row_offset, first_row);
        place(part.column, packet.column_line, part.column0, layout.begin[2], layout.end[2], column_offset,
              first_column);
        const std::ptrdiff_t stride = layout.row_stride;
        const Voxel* plane = voxel_at<Voxel>(layout, part.begin, part.row0, part.column0);
        const __m512 half = _mm512_set1_ps(0.5F), one = _mm512_set1_ps(1);
        Sums<order> sums;
        __m512 number = _mm512_setzero_ps();
        const int count = part.end - part.begin;
        for (int step = 0; step < count; ++step) {
            const int k = samples.forward ? step : count - 1 - step;
            const __m512 end = samples.end(k, step + 1 == count);
            __mmask16 active = _mm512_cmp_ps_mask(number, end, _CMP_LT_OQ);
            if (!active) continue;
            if (part.begin + k >= layout.end[0]) {  // behind the last plane that is there
                number = _mm512_max_ps(number, end);
                continue;
            }
            const Voxel* voxels = plane + k * layout.plane_stride + row_offset[k] * stride + column_offset[k];
            const Tables<Voxel> even(voxels, 2 * stride, layout.plane_stride),
                odd(voxels + stride, 2 * stride, layout.plane_stride);
            const __m512 p0 = _mm512_sub_ps(samples.plane, _mm512_set1_ps(kSteps[k]));
            const __m512 r0 = _mm512_mul_ps(half, _mm512_sub_ps(samples.row, _mm512_set1_ps(first_row[k])));
            const __m512 c0 = _mm512_sub_ps(samples.column, _mm512_set1_ps(first_column[k]));
            do {
                const __m512 fp = _mm512_fmadd_ps(number, samples.plane_step, p0);
                const __m512 r = _mm512_fmadd_ps(number, samples.half_row_step, r0);
                const __m512 c = _mm512_fmadd_ps(number, samples.column_step, c0);
                sums.add(even, odd, fp, r, c, number, active);
                number = _mm512_mask_add_ps(number, active, number, one);
                active = _mm512_cmp_ps_mask(number, end, _CMP_LT_OQ);
            } while (active);
        }
        sums.store(packet, samples.first_number);
    }

private:
    static constexpr float kSteps[kSlabPlanes] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    static constexpr float kIntegerBits = 12582912;  // 1.5 * 2^23, as in Footprint

    /// What lies below all rays of some lanes, and how far apart they are.
    struct Line {
        double slope = 0, spread = 0, steepest = 0;

        Line() = default;
        Line(const double (&slopes)[16], unsigned lanes, bool forward) {
            double low = __builtin_inf(), high = -__builtin_inf();
            for (int i = 0; i < 16; ++i) {
                low = lanes >> i & 1 ? minimum(low, slopes[i]) : low;
                high = lanes >> i & 1 ? maximum(high, slopes[i]) : high;
            }
            slope = forward ? low : high;
            spread = high - low;
            steepest = maximum(__builtin_fabs(low), __builtin_fabs(high));
        }
        /// Rows (or columns) that samples between two planes can be apart. Up to 5.99, eight voxels hold all they need.
        [[nodiscard]] double reach(double distance) const { return spread * distance + steepest; }
    };

    /// For all pairs of planes of a part at once (one a lane): the first row (or column) of the footprint, from
    /// `origin` on. Clamped to the zeros around what is stored: there any place will do.
    static void place(double start, double line, int origin, int begin, int end, std::int32_t* offset, float* first) {
        const __m512 slope = _mm512_set1_ps(static_cast<float>(line));
        const __m512 here = _mm512_fmadd_ps(_mm512_loadu_ps(kSteps), slope,
                                            _mm512_set1_ps(static_cast<float>(start - origin - kSlack)));
        const __m512 low = _mm512_roundscale_ps(_mm512_min_ps(here, _mm512_add_ps(here, slope)),
                                                _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
        const __m512 clamped =
            _mm512_min_ps(_mm512_max_ps(low, _mm512_set1_ps(static_cast<float>(begin - kPadVoxels - origin))),
                          _mm512_set1_ps(static_cast<float>(end - origin)));
        _mm512_store_ps(first, clamped);
        _mm512_store_si512(offset, _mm512_cvttps_epi32(clamped));
    }

    /// The samples that each lane has in a part, numbered from its first one; coordinates from the part's first plane
    /// and from (row0, column0) on.
    struct Samples {
        __m512 plane, plane_step, row, half_row_step, column, column_step;
        __m512 count, per_plane, passed;  ///< passed: samples per_plane * k + passed are behind plane k
        __m512 first_number;
        bool forward, some;

        Samples(const Packet& packet, const SlabPart& part) {
            const __m512d begin = _mm512_set1_pd(part.begin), end = _mm512_set1_pd(part.end);
            __m256 planes[2], rows[2], columns[2], steps[3][2], counts[2], per_planes[2], firsts[2];
            for (std::ptrdiff_t h = 0; h < 2; ++h) {
                const auto load = [h](const double* values) { return _mm512_load_pd(values + 8 * h); };
                const __m512d start = load(packet.start[0]), step = load(packet.step[0]);
                const __m512d inverse = _mm512_div_pd(_mm512_set1_pd(1), step);
                const __m512d a = number_at(begin, start, inverse), b = number_at(end, start, inverse);
                // The same number ends one part and begins the next: no sample counts twice.
                const __m512d first = _mm512_max_pd(_mm512_min_pd(a, b), _mm512_setzero_pd());
                const __m512d last = _mm512_min_pd(_mm512_max_pd(a, b), load(packet.end));
                firsts[h] = _mm512_cvtpd_ps(first);
                counts[h] = _mm512_cvtpd_ps(_mm512_sub_pd(last, first));
                per_planes[h] = _mm512_cvtpd_ps(inverse);
                planes[h] = _mm512_cvtpd_ps(_mm512_sub_pd(_mm512_fmadd_pd(first, step, start), begin));
                rows[h] = _mm512_cvtpd_ps(_mm512_sub_pd(
                    _mm512_fmadd_pd(first, load(packet.step[1]), load(packet.start[1])), _mm512_set1_pd(part.row0)));
                columns[h] = _mm512_cvtpd_ps(_mm512_sub_pd(
                    _mm512_fmadd_pd(first, load(packet.step[2]), load(packet.start[2])), _mm512_set1_pd(part.column0)));
                for (int axis = 0; axis < 3; ++axis) steps[axis][h] = _mm512_cvtpd_ps(load(packet.step[axis]));
            }
            const auto join = [](const __m256(&halves)[2]) {
                return _mm512_insertf32x8(_mm512_castps256_ps512(halves[0]), halves[1], 1);
            };
            plane = join(planes);
            row = join(rows);
            column = join(columns);
            plane_step = join(steps[0]);
            half_row_step = _mm512_mul_ps(_mm512_set1_ps(0.5F), join(steps[1]));
            column_step = join(steps[2]);
            per_plane = join(per_planes);
            passed = _mm512_fnmadd_ps(plane, per_plane, _mm512_setzero_ps());
            first_number = join(firsts);
            count = _mm512_maskz_mov_ps(static_cast<__mmask16>(packet.lanes), join(counts));
            some = _mm512_cmp_ps_mask(count, _mm512_setzero_ps(), _CMP_GT_OQ) != 0;
            forward = packet.step[0][0] > 0;
        }

        static __m512d number_at(__m512d plane, __m512d start, __m512d inverse) {
            return _mm512_roundscale_pd(_mm512_mul_pd(_mm512_sub_pd(plane, start), inverse),
                                        _MM_FROUND_TO_POS_INF | _MM_FROUND_NO_EXC);
        }

        /// The number of the first sample that is no longer between planes k and k + 1; all are passed at the last.
        [[nodiscard]] __m512 end(int k, bool last) const {
            if (last) return count;
            const __m512 border = _mm512_set1_ps(kSteps[k] + (forward ? 1.F : 0.F));
            const __m512 number = _mm512_roundscale_ps(_mm512_fmadd_ps(border, per_plane, passed),
                                                       _MM_FROUND_TO_POS_INF | _MM_FROUND_NO_EXC);
            return _mm512_min_ps(number, count);
        }
    };

    /// Every second row of a footprint in one plane, and the rise to the next plane.
    template <class Voxel>
    struct Tables {
        __m512 low0, low1, rise0, rise1;

        Tables(const Voxel* voxels, std::ptrdiff_t distance, std::ptrdiff_t plane)
            : low0(Rows::load(voxels, distance)),
              low1(Rows::load(voxels + 2 * distance, distance)),
              rise0(_mm512_sub_ps(Rows::load(voxels + plane, distance), low0)),
              rise1(_mm512_sub_ps(Rows::load(voxels + plane + 2 * distance, distance), low1)) {}

        [[nodiscard]] __m512 low(__m512i index) const { return _mm512_permutex2var_ps(low0, index, low1); }
        [[nodiscard]] __m512 rise(__m512i index) const { return _mm512_permutex2var_ps(rise0, index, rise1); }
    };
    using Rows = FootprintRows;

    template <Order order>
    struct Sums {
        __m512 value = _mm512_setzero_ps();
        __m512 slope[3] = {value, value, value}, moment[3] = {value, value, value};

        template <class Voxel>
        void add(const Tables<Voxel>& even, const Tables<Voxel>& odd, __m512 fp, __m512 r, __m512 c, __m512 number,
                 __mmask16 active) {
            const __m512 even_row = _mm512_roundscale_ps(r, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);
            const __m512 odd_row = _mm512_roundscale_ps(r, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
            const __m512 column = _mm512_roundscale_ps(c, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
            const __m512 cell = _mm512_add_ps(column, _mm512_set1_ps(kIntegerBits)), eight = _mm512_set1_ps(8);
            const __m512i one = _mm512_set1_epi32(1);
            const __m512i e0 = _mm512_castps_si512(_mm512_fmadd_ps(eight, even_row, cell)),
                          e1 = _mm512_add_epi32(e0, one);
            const __m512i o0 = _mm512_castps_si512(_mm512_fmadd_ps(eight, odd_row, cell)),
                          o1 = _mm512_add_epi32(o0, one);
            const __m512 fc = _mm512_sub_ps(c, column), above = _mm512_sub_ps(r, even_row);
            // Half rows count double.
            const __m512 distance = _mm512_add_ps(_mm512_abs_ps(above), _mm512_abs_ps(above));
            const __m512 re0 = even.rise(e0), re1 = even.rise(e1), ro0 = odd.rise(o0), ro1 = odd.rise(o1);
            const __m512 ve0 = _mm512_fmadd_ps(fp, re0, even.low(e0)), ve1 = _mm512_fmadd_ps(fp, re1, even.low(e1));
            const __m512 vo0 = _mm512_fmadd_ps(fp, ro0, odd.low(o0)), vo1 = _mm512_fmadd_ps(fp, ro1, odd.low(o1));
            const __m512 de = _mm512_sub_ps(ve1, ve0), dodd = _mm512_sub_ps(vo1, vo0);
            const __m512 ve = _mm512_fmadd_ps(fc, de, ve0), up = _mm512_sub_ps(_mm512_fmadd_ps(fc, dodd, vo0), ve);
            value = _mm512_mask_add_ps(value, active, value, _mm512_fmadd_ps(distance, up, ve));
            if constexpr (order == Order::derivatives) {
                // Downwards from the even row the slope is the other way round.
                add_slope(1, _mm512_xor_ps(up, _mm512_and_ps(above, _mm512_set1_ps(-0.F))), number, active);
                add_slope(2, _mm512_fmadd_ps(distance, _mm512_sub_ps(dodd, de), de), number, active);
                const __m512 re = _mm512_fmadd_ps(fc, _mm512_sub_ps(re1, re0), re0),
                             ro = _mm512_fmadd_ps(fc, _mm512_sub_ps(ro1, ro0), ro0);
                add_slope(0, _mm512_fmadd_ps(distance, _mm512_sub_ps(ro, re), re), number, active);
            }
        }
        void add_slope(int axis, __m512 along, __m512 number, __mmask16 active) {
            slope[axis] = _mm512_mask_add_ps(slope[axis], active, slope[axis], along);
            moment[axis] = _mm512_mask3_fmadd_ps(number, along, moment[axis], active);
        }

        void store(Packet& packet, __m512 first_number) const {
            const auto add_to = [](float* sum, __m512 part) {
                _mm512_store_ps(sum, _mm512_add_ps(_mm512_load_ps(sum), part));
            };
            add_to(packet.sum, value);
            if constexpr (order == Order::derivatives) {
                const __m512 first = _mm512_add_ps(first_number, _mm512_set1_ps(0.5F));
                for (int axis = 0; axis < 3; ++axis) {
                    add_to(packet.gradient[axis], slope[axis]);
                    add_to(packet.moment[axis], _mm512_fmadd_ps(first, slope[axis], moment[axis]));
                }
            }
        }
    };
};

}  // namespace
}  // namespace raylign::detail::cpu

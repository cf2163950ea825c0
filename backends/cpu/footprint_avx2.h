#pragma once

#include <immintrin.h>

#include <type_traits>

#include "backends/cpu/joseph_derivatives.h"
#include "backends/cpu/joseph_tile.h"

namespace raylign::detail::cpu {
namespace {

using Avx2 = xsimd::fma3<xsimd::avx2>;

/// The lines of a packet's two squares of 2 x 2 rays, which go into a register's halves. As JosephPacket's row_line and
/// column_line they bound the rays of a square on one side; these offsets from those lines are what float holds well.
template <>
struct FootprintLines<Avx2> {
    float row[2], column[2];
    float row_spread, column_spread;  ///< the largest distance of a ray from its square's line, per plane

    template <class Packet>
    void set(const Packet& packet, bool planes_follow) {
        set(packet.row_offset, planes_follow, row, row_spread);
        set(packet.column_offset, planes_follow, column, column_spread);
    }

private:
    static void set(const float* offset, bool planes_follow, float* line, float& spread) {
        spread = 0;
        for (int square = 0; square < 2; ++square, offset += 2) {
            const float a = offset[0] < offset[1] ? offset[0] : offset[1],
                        b = offset[4] < offset[5] ? offset[4] : offset[5],
                        c = offset[0] < offset[1] ? offset[1] : offset[0],
                        d = offset[4] < offset[5] ? offset[5] : offset[4];
            const float low = a < b ? a : b, high = c < d ? d : c;
            line[square] = planes_follow ? low : high;
            spread = high - low > spread ? high - low : spread;
        }
    }
};

/// Bilinear samples of int16 voxels without gathers. Four rays, a square of 2 x 2 pixels, meet a few rows of eight
/// voxels in a plane; each half of a register takes a square. Of each row one byte shuffle brings every ray its two
/// neighbours, and one multiply-add of 16-bit numbers goes from one to the other, exact but for the fraction.
///
/// Between two rows one is even and one is odd (counted from the footprint's first), so a sample takes one pair of each
/// kind, and its weight for the odd row is the distance from the even one.
///
/// Places are int32 with 24 bits behind the point, off by 2^-20 voxels at most. Fractions along a row have 15 bits:
/// j / 32767 stands for [j, j + 1) / 32768, which is off by 2^-15 at most and by nothing on average. So a sample is off
/// by 2^-15 of the step between two neighbours in its row.
template <>
struct Footprint<Avx2> {
    using Packet = JosephPacket<Avx2>;
    static constexpr VoxelStorage storage = kInt16;

    /// Adds the planes of a slab to the packet's sums; false, with nothing done, where the footprint is too large.
    template <class Voxel, Order order>
    static bool march(const PlaneLayout& layout, Packet& packet, const SlabPart& part, const ReadAhead& ahead) {
        if constexpr (std::is_same_v<Voxel, std::int16_t>) {
            // Columns first .. first + 6 may start a pair, rows first .. first + rows - 2; the first lies up to 1.001
            // below the lowest sample.
            const double distance = maximum(__builtin_fabs(part.d0), __builtin_fabs(part.d1));
            if (packet.lines.column_spread * distance > 5.99) return false;
            const double rows = packet.lines.row_spread * distance;
            if (rows > 3.99) return false;
            if (rows > 1.99) {
                march_rows<6, order>(layout, packet, part, ahead);
            } else {
                march_rows<4, order>(layout, packet, part, ahead);
            }
            return true;
        }
        return false;
    }

private:
    static constexpr float kPoint = 16777216;  // 2^24
    /// Rows are counted in so many bits, so that the sign tells the upper half of them.
    template <int rows>
    static constexpr int kRowBits = rows == 4 ? 2 : 3;

    /// A line across the planes of a slab, per lane: where it is on the first plane and how far it goes to the next.
    struct Line {
        __m256i at, step;

        void advance() { at = _mm256_add_epi32(at, step); }
        [[nodiscard]] __m256i whole(int bits) const {
            return _mm256_and_si256(at, _mm256_set1_epi32(static_cast<int>(~0U << (32 - bits))));
        }
        /// With so many bits before the point instead of 8: what is above is lost, and not missed in differences.
        [[nodiscard]] Line with_whole_bits(int bits) const {
            return {_mm256_slli_epi32(at, 8 - bits), _mm256_slli_epi32(step, 8 - bits)};
        }
    };
    static __m256i fixed(__m256 value) { return _mm256_cvtps_epi32(_mm256_mul_ps(value, _mm256_set1_ps(kPoint))); }
    static Line line(double start, double slope, double distance, __m256 offset) {
        const __m256 d = _mm256_set1_ps(static_cast<float>(distance));
        return {fixed(_mm256_fmadd_ps(d, offset, _mm256_set1_ps(static_cast<float>(start)))),
                fixed(_mm256_add_ps(offset, _mm256_set1_ps(static_cast<float>(slope))))};
    }
    /// Pixels 0, 1 of both rows of a packet, then pixels 2, 3; and back.
    static __m256 by_squares(__m256 lanes) {
        return _mm256_castpd_ps(_mm256_permute4x64_pd(_mm256_castps_pd(lanes), _MM_SHUFFLE(3, 1, 2, 0)));
    }
    static __m256 halves(const float (&values)[2]) {
        return _mm256_setr_m128(_mm_set1_ps(values[0]), _mm_set1_ps(values[1]));
    }
    static __m256i every_four(char a, char b, char c, char d, int step) {
        const auto at = [&](char first, int lane) { return static_cast<char>(first + lane * step); };
        return _mm256_broadcastsi128_si256(_mm_setr_epi8(at(a, 0), at(b, 0), at(c, 0), at(d, 0), at(a, 1), at(b, 1),
                                                         at(c, 1), at(d, 1), at(a, 2), at(b, 2), at(c, 2), at(d, 2),
                                                         at(a, 3), at(b, 3), at(c, 3), at(d, 3)));
    }

    /// Where the footprints of a slab begin in memory, relative to voxel (row0, column0). They are clamped to the
    /// padding: there all is zero, and any place will do.
    struct Places {
        alignas(32) std::int32_t offset[2][kSlabPlanes];

        Places(const PlaneLayout& layout, const SlabPart& part, const Line& rows, const Line& columns) {
            alignas(32) std::int32_t row[8], row_step[8], column[8], column_step[8];
            _mm256_store_si256(reinterpret_cast<__m256i*>(row), rows.at);
            _mm256_store_si256(reinterpret_cast<__m256i*>(row_step), rows.step);
            _mm256_store_si256(reinterpret_cast<__m256i*>(column), columns.at);
            _mm256_store_si256(reinterpret_cast<__m256i*>(column_step), columns.step);
            const __m256i stride = _mm256_set1_epi32(static_cast<std::int32_t>(layout.row_stride));
            for (std::size_t square = 0; square < 2; ++square) {
                const std::size_t lane = 4 * square;
                Line r = planes(row[lane], row_step[lane]), c = planes(column[lane], column_step[lane]);
                for (int k = 0; k < kSlabPlanes; k += 8, r.advance(), c.advance()) {
                    const __m256i whole_r = clamped(r, layout.begin[1] - part.row0, layout.end[1] - part.row0);
                    const __m256i whole_c = clamped(c, layout.begin[2] - part.column0, layout.end[2] - part.column0);
                    _mm256_store_si256(reinterpret_cast<__m256i*>(offset[square] + k),
                                       _mm256_add_epi32(_mm256_mullo_epi32(whole_r, stride), whole_c));
                }
            }
        }

    private:
        /// A lane's places on the first eight planes, and the way to the next eight.
        static Line planes(std::int32_t at, std::int32_t step) {
            const __m256i each = _mm256_set1_epi32(step);
            return {_mm256_add_epi32(_mm256_set1_epi32(at),
                                     _mm256_mullo_epi32(each, _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7))),
                    _mm256_slli_epi32(each, 3)};
        }
        static __m256i clamped(const Line& line, int begin, int end) {
            return _mm256_min_epi32(
                _mm256_max_epi32(_mm256_srai_epi32(line.at, 24), _mm256_set1_epi32(begin - kPadVoxels)),
                _mm256_set1_epi32(end));
        }
    };

    static __m256i row_of_both(const std::int16_t* first, const std::int16_t* second) {
        const __m128i low = _mm_loadu_si128(reinterpret_cast<const __m128i*>(first));
        return _mm256_inserti128_si256(_mm256_castsi128_si256(low),
                                       _mm_loadu_si128(reinterpret_cast<const __m128i*>(second)), 1);
    }
    /// The second of two where the row, a number in the top bits of r, is `least` or more. The choice goes by the sign,
    /// that is, by whether the row is 2 (of three) or 4 (of five).
    template <int rows>
    static __m256i from_row(int least, __m256i r, __m256i below, __m256i above) {
        constexpr int half = rows == 4 ? 2 : 4, bits = kRowBits<rows>;
        const __m256i sign = least == half ? r : _mm256_add_epi32(r, _mm256_set1_epi32((half - least) << (32 - bits)));
        return _mm256_castps_si256(
            _mm256_blendv_ps(_mm256_castsi256_ps(below), _mm256_castsi256_ps(above), _mm256_castsi256_ps(sign)));
    }

    /// Sums of slopes over the planes of a slab. What was summed before each plane is summed again: of K planes
    /// sum_k (K - 1 - k) slope_k, which takes one addition where products with k take a register more.
    struct Slopes {
        __m256 row = _mm256_setzero_ps(), odd = row, rows_before = row, odds_before = row;
        __m256i even = _mm256_setzero_si256(), evens_before = even;

        /// The slope along rows: upwards where `rise` is; along columns: that of the even row, and what the odd one
        /// adds.
        void add(__m256 rise, __m256i even_rise, __m256i more, __m256 distance) {
            rows_before = _mm256_add_ps(rows_before, row);
            odds_before = _mm256_add_ps(odds_before, odd);
            evens_before = _mm256_add_epi32(evens_before, even);
            row = _mm256_add_ps(row, rise);
            even = _mm256_add_epi32(even, even_rise);
            odd = _mm256_fmadd_ps(distance, _mm256_cvtepi32_ps(more), odd);
        }
        void store(Packet& packet, const SlabPart& part, __m256 unit) const {
            using Floats = xsimd::batch<float, Avx2>;
            const auto columns = [](__m256i evens, __m256 odds) {
                return _mm256_fmadd_ps(_mm256_set1_ps(0x1p-31F), odds, _mm256_cvtepi32_ps(evens));
            };
            const __m256 last = _mm256_set1_ps(static_cast<float>(part.end - part.begin - 1));
            SlopeSums<Floats> sums;
            sums.row = by_squares(_mm256_mul_ps(unit, row));
            sums.row_moment = by_squares(_mm256_mul_ps(unit, _mm256_fmsub_ps(last, row, rows_before)));
            const __m256 column = columns(even, odd);
            sums.column = by_squares(column);
            sums.column_moment = by_squares(_mm256_fmsub_ps(last, column, columns(evens_before, odds_before)));
            sums.store(packet, Floats(static_cast<float>(part.d0)));
        }
    };

    template <int rows, Order order>
    static void march_rows(const PlaneLayout& layout, Packet& packet, const SlabPart& part, const ReadAhead& ahead) {
        const double row0 = part.row - part.row0, column0 = part.column - part.column0, margin = 1e-3;
        Line row = line(row0, packet.row_line, part.d0, by_squares(_mm256_load_ps(packet.row_offset)));
        Line column = line(column0, packet.column_line, part.d0, by_squares(_mm256_load_ps(packet.column_offset)));
        Line row_base = line(row0 - margin, packet.row_line, part.d0, halves(packet.lines.row));
        Line column_base = line(column0 - margin, packet.column_line, part.d0, halves(packet.lines.column));
        const Places places(layout, part, row_base, column_base);
        row = row.with_whole_bits(kRowBits<rows>);
        row.at = _mm256_or_si256(row.at, _mm256_set1_epi32(1));  // no sample lies on a row: it has a side
        row_base = row_base.with_whole_bits(kRowBits<rows>);
        const __m256i whole_columns = every_four(3, 3, 3, 3, 4), fractions = every_four(1, 2, 1, 2, 4),
                      bytes = every_four(0, 1, 2, 3, 0), complement = _mm256_set1_epi32(0x7FFF),
                      difference = _mm256_set1_epi32(0x0001FFFF);
        const std::ptrdiff_t stride = layout.row_stride;
        const std::int16_t* plane = voxel_at<std::int16_t>(layout, part.begin, part.row0, part.column0);
        __m256 even_sum = _mm256_setzero_ps(), odd_sum = _mm256_setzero_ps();
        Slopes slopes;
        for (int k = 0; k < part.end - part.begin; ++k, plane += layout.plane_stride) {
            ahead.on_plane(k);
            const __m256i r = _mm256_sub_epi32(row.at, row_base.whole(kRowBits<rows>));
            // Of the column's distance only the whole is needed: bytes on their own, whatever the others become.
            const __m256i first = _mm256_shuffle_epi8(_mm256_sub_epi8(column.at, column_base.at), whole_columns);
            const __m256i index = _mm256_add_epi8(_mm256_add_epi8(first, first), bytes);
            const __m256i weights =
                _mm256_xor_si256(_mm256_srli_epi16(_mm256_shuffle_epi8(column.at, fractions), 1), complement);
            const std::int16_t *a = plane + places.offset[0][k], *b = plane + places.offset[1][k];
            const auto pairs = [&](int i) {
                return _mm256_shuffle_epi8(row_of_both(a + i * stride, b + i * stride), index);
            };
            __m256i even = from_row<rows>(1, r, pairs(0), pairs(2)), odd = from_row<rows>(2, r, pairs(1), pairs(3));
            if constexpr (rows == 6) {
                even = from_row<rows>(3, r, even, pairs(4));
                odd = from_row<rows>(4, r, odd, pairs(5));
            }
            // The row modulo 2, in [-1, 1): its size is the distance from the even row, its sign says on which side.
            const __m256i side = _mm256_slli_epi32(r, kRowBits<rows> - 1);
            const __m256 distance = _mm256_cvtepi32_ps(side);
            const __m256i e = _mm256_madd_epi16(even, weights), o = _mm256_madd_epi16(odd, weights);
            const __m256 rise = _mm256_cvtepi32_ps(_mm256_sign_epi32(_mm256_sub_epi32(o, e), side));
            even_sum = _mm256_add_ps(even_sum, _mm256_cvtepi32_ps(e));
            odd_sum = _mm256_fmadd_ps(distance, rise, odd_sum);
            if constexpr (order == Order::derivatives) {
                const __m256i e_rise = _mm256_madd_epi16(even, difference), o_rise = _mm256_madd_epi16(odd, difference);
                slopes.add(rise, e_rise, _mm256_sign_epi32(_mm256_sub_epi32(o_rise, e_rise), side), distance);
            }
            row.advance();
            column.advance();
            row_base.advance();
            column_base.advance();
        }
        const __m256 unit = _mm256_set1_ps(1 / 32767.F);
        const __m256 sum = _mm256_mul_ps(unit, _mm256_fmadd_ps(_mm256_set1_ps(0x1p-31F), odd_sum, even_sum));
        _mm256_store_ps(packet.sum, _mm256_add_ps(_mm256_load_ps(packet.sum), by_squares(sum)));
        if constexpr (order == Order::derivatives) slopes.store(packet, part, unit);
    }
};

}  // namespace
}  // namespace raylign::detail::cpu

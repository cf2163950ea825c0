#pragma once

#include <arm_neon.h>

#include <type_traits>

#include "backends/cpu/joseph_derivatives.h"
#include "backends/cpu/joseph_tile.h"

namespace raylign::detail::cpu {
namespace {

/// Bilinear samples of int16 voxels without gathers, as on AVX2 (footprint_avx2.h): a packet of 2 x 2 rays meets a few
/// rows of eight voxels in a plane. Here those rows are one table of bytes: one look-up brings every ray its two voxels
/// of the row below it, another, of the same places in the rows from the second on, those of the row above.
///
/// Places and fractions are as on AVX2, and as exact.
template <>
struct Footprint<xsimd::neon64> {
    using Packet = JosephPacket<xsimd::neon64>;
    static constexpr VoxelStorage storage = kInt16;

    /// Adds the planes of a slab to the packet's sums; false, with nothing done, where the footprint is too large.
    template <class Voxel, Order order>
    static bool march(const PlaneLayout& layout, Packet& packet, const SlabPart& part, const ReadAhead& ahead) {
        if constexpr (std::is_same_v<Voxel, std::int16_t>) {
            // Columns first .. first + 6 may start a pair, rows first .. first + rows - 2; the first lies up to 1.001
            // below the lowest sample.
            const double distance = maximum(__builtin_fabs(part.d0), __builtin_fabs(part.d1));
            if (packet.column_spread * distance > 5.99) return false;
            const double rows = packet.row_spread * distance;
            if (rows > 2.99) return false;
            if (rows > 1.99) {
                march_rows<5, order>(layout, packet, part, ahead);
            } else if (rows > 0.99) {
                march_rows<4, order>(layout, packet, part, ahead);
            } else {
                march_rows<3, order>(layout, packet, part, ahead);
            }
            return true;
        }
        return false;
    }

private:
    static constexpr float kSteps[kSlabPlanes] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    static constexpr double kPoint = 16777216;  // 2^24

    /// Across the planes of a slab: a place on the first plane, and how far it goes to the next.
    struct Place {
        std::int32_t at, step;

        Place(double start, double slope)
            : at(static_cast<std::int32_t>(start * kPoint)), step(static_cast<std::int32_t>(slope * kPoint)) {}
        /// Whole voxels on planes k .. k + 3, clamped to the padding: there all is zero, and any place will do.
        [[nodiscard]] int32x4_t whole(int k, int begin, int end) const {
            const int32x4_t planes = {k, k + 1, k + 2, k + 3};
            const int32x4_t place = vshrq_n_s32(vmlaq_n_s32(vdupq_n_s32(at), planes, step), 24);
            return vminq_s32(vmaxq_s32(place, vdupq_n_s32(begin - kPadVoxels)), vdupq_n_s32(end));
        }
    };

    /// The same per lane, with the point `whole_bits` below the top: what is more is lost, and not missed in
    /// differences.
    template <int whole_bits>
    struct Line {
        uint32x4_t at, step;

        static Line of(double start, double slope, double distance, const float* offset) {
            const float32x4_t offsets = vld1q_f32(offset);
            return {fixed(vfmaq_n_f32(vdupq_n_f32(static_cast<float>(start)), offsets, static_cast<float>(distance))),
                    fixed(vaddq_f32(offsets, vdupq_n_f32(static_cast<float>(slope))))};
        }
        static Line of(const Place& place) {
            return {vshlq_n_u32(vdupq_n_u32(static_cast<std::uint32_t>(place.at)), 8 - whole_bits),
                    vshlq_n_u32(vdupq_n_u32(static_cast<std::uint32_t>(place.step)), 8 - whole_bits)};
        }
        void advance() { at = vaddq_u32(at, step); }
        /// From the voxel that `base` has reached.
        [[nodiscard]] uint32x4_t from(const Line& base) const {
            return vsubq_u32(at, vandq_u32(base.at, vdupq_n_u32(~0U << (32 - whole_bits))));
        }

    private:
        static uint32x4_t fixed(float32x4_t value) {
            return vshlq_n_u32(vreinterpretq_u32_s32(vcvtnq_s32_f32(vmulq_n_f32(value, kPoint))), 8 - whole_bits);
        }
    };

    static uint8x16_t byte_of_lanes(int a, int b) {
        const auto at = [](int first, int lane) { return static_cast<std::uint8_t>(first + 4 * lane); };
        const uint8x8_t half = {at(a, 0), at(b, 0), at(a, 1), at(b, 1), at(a, 2), at(b, 2), at(a, 3), at(b, 3)};
        return vcombine_u8(half, half);
    }

    /// Every ray's voxels of one row, first the left ones, then the right ones.
    template <int rows>
    static int16x8_t look_up(const std::int16_t* first, std::ptrdiff_t stride, uint8x16_t index) {
        const auto row = [&](int i) { return vreinterpretq_u8_s16(vld1q_s16(first + i * stride)); };
        if constexpr (rows == 2) return vreinterpretq_s16_u8(vqtbl2q_u8({row(0), row(1)}, index));
        if constexpr (rows == 3) return vreinterpretq_s16_u8(vqtbl3q_u8({row(0), row(1), row(2)}, index));
        if constexpr (rows == 4) return vreinterpretq_s16_u8(vqtbl4q_u8({row(0), row(1), row(2), row(3)}, index));
    }
    static int32x4_t blend(int16x8_t pairs, int16x8_t weights) {
        return vmlal_high_s16(vmull_s16(vget_low_s16(pairs), vget_low_s16(weights)), pairs, weights);
    }
    static int32x4_t less(int32x4_t from, int16x8_t pairs, int16x8_t weights) {
        return vmlsl_high_s16(vmlsl_s16(from, vget_low_s16(pairs), vget_low_s16(weights)), pairs, weights);
    }

    /// A function of its own, or g++ 12 has no registers left for the loop's constants.
    template <int rows, Order order>
    [[gnu::noinline]] static void march_rows(const PlaneLayout& layout, Packet& packet, const SlabPart& part,
                                             const ReadAhead& ahead) {
        const double row0 = part.row - part.row0, column0 = part.column - part.column0, margin = 1e-3;
        auto row = Line<5>::of(row0, packet.row_line, part.d0, packet.row_offset);
        auto column = Line<3>::of(column0, packet.column_line, part.d0, packet.column_offset);
        const Place row_place(row0 - margin, packet.row_line), column_place(column0 - margin, packet.column_line);
        auto row_base = Line<5>::of(row_place);
        auto column_base = Line<3>::of(column_place);
        alignas(16) std::int32_t offset[kSlabPlanes];
        for (int k = 0; k < kSlabPlanes; k += 4) {
            vst1q_s32(offset + k,
                      vmlaq_n_s32(column_place.whole(k, layout.begin[2] - part.column0, layout.end[2] - part.column0),
                                  row_place.whole(k, layout.begin[1] - part.row0, layout.end[1] - part.row0),
                                  static_cast<std::int32_t>(layout.row_stride)));
        }
        const uint8x16_t whole = byte_of_lanes(3, 3), fractions = byte_of_lanes(1, 2);
        const uint8x16_t bytes = {0, 1, 0, 1, 0, 1, 0, 1, 2, 3, 2, 3, 2, 3, 2, 3};
        const uint16x8_t complement = {0x7FFF, 0x7FFF, 0x7FFF, 0x7FFF, 0, 0, 0, 0};
        const int16x8_t difference = {-1, -1, -1, -1, 1, 1, 1, 1};
        const std::ptrdiff_t stride = layout.row_stride;
        const std::int16_t* plane = voxel_at<std::int16_t>(layout, part.begin, part.row0, part.column0);
        int32x4_t lower_sum = vdupq_n_s32(0);
        float32x4_t fall_sum = vdupq_n_f32(0);
        SlopeSums<xsimd::batch<float, xsimd::neon64>> slopes;
        for (int k = 0; k < part.end - part.begin; ++k, plane += layout.plane_stride) {
            ahead.on_plane(k);
            const uint32x4_t r = row.from(row_base), c = column.from(column_base);
            // From the top: 5 bits of the row, 3 of the column, and the column's fraction.
            const uint8x16_t both = vreinterpretq_u8_u32(vsriq_n_u32(r, c, 5));
            const uint8x16_t place = vqtbl1q_u8(both, whole);
            const uint8x16_t index = vaddq_u8(vaddq_u8(place, place), bytes);
            const int16x8_t weights = vreinterpretq_s16_u16(
                veorq_u16(vshrq_n_u16(vreinterpretq_u16_u8(vqtbl1q_u8(both, fractions)), 1), complement));
            const std::int16_t* first = plane + offset[k];
            const std::int16_t* second = first + stride;
            asm("" : "+r"(second));  // else the compiler copies registers to have some rows in both tables
            const int16x8_t lower = look_up<rows - 1>(first, stride, index),
                            upper = look_up<rows - 1>(second, stride, index);
            const float32x4_t fraction = vcvtq_n_f32_u32(vshlq_n_u32(row.at, 5), 32);
            const int32x4_t value = blend(lower, weights);
            lower_sum = vrsraq_n_s32(lower_sum, value, 4);
            const float32x4_t fall = vcvtq_f32_s32(less(value, upper, weights));
            fall_sum = vfmaq_f32(fall_sum, fraction, fall);
            if constexpr (order == Order::derivatives) {
                const int32x4_t rise = blend(lower, difference);
                const float32x4_t along =
                    vfmsq_f32(vcvtq_f32_s32(rise), fraction, vcvtq_f32_s32(less(rise, upper, difference)));
                slopes.add(fall, along, vdupq_n_f32(kSteps[k]));
            }
            row.advance();
            column.advance();
            row_base.advance();
            column_base.advance();
        }
        const float unit = 1 / 32767.F;
        const float32x4_t sum =
            vmulq_n_f32(vfmsq_f32(vcvtq_f32_s32(lower_sum), fall_sum, vdupq_n_f32(0x1p-4F)), 16 * unit);
        vst1q_f32(packet.sum, vaddq_f32(vld1q_f32(packet.sum), sum));
        if constexpr (order == Order::derivatives) {
            slopes.row = vmulq_n_f32(slopes.row, -unit);
            slopes.row_moment = vmulq_n_f32(slopes.row_moment, -unit);
            slopes.store(packet, xsimd::batch<float, xsimd::neon64>(static_cast<float>(part.d0)));
        }
    }
};

}  // namespace
}  // namespace raylign::detail::cpu

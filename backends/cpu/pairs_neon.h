#pragma once

#include <arm_neon.h>

#include "backends/cpu/pairs.h"

namespace raylign::detail::cpu {
namespace {

/// Two pairs in one register.
inline float32x4_t two_pairs(const float* a, const float* b) { return vcombine_f32(vld1_f32(a), vld1_f32(b)); }

template <>
struct Pairs<xsimd::neon64> {
    using Floats = Lanes<xsimd::neon64>::Floats;
    using Ints = Lanes<xsimd::neon64>::Ints;

    static void load(const float* voxels, const Ints& index, Floats& first, Floats& second) {
        alignas(16) std::int32_t i[4];
        index.store_aligned(i);
        const float32x4_t a = two_pairs(voxels + i[0], voxels + i[1]), b = two_pairs(voxels + i[2], voxels + i[3]);
        first = vuzp1q_f32(a, b);
        second = vuzp2q_f32(a, b);
    }
    static void load(const std::int16_t* voxels, const Ints& index, Floats& first, Floats& second) {
        alignas(16) std::int32_t i[4];
        index.store_aligned(i);
        const auto pair = [&](int lane) {
            std::int32_t both;
            __builtin_memcpy(&both, voxels + i[lane], sizeof(both));
            return both;
        };
        const int32x4_t pairs = {pair(0), pair(1), pair(2), pair(3)};
        first = vcvtq_n_f32_s32(vshlq_n_s32(pairs, 16), 16);
        second = vcvtq_f32_s32(vshrq_n_s32(pairs, 16));
    }
};

}  // namespace
}  // namespace raylign::detail::cpu

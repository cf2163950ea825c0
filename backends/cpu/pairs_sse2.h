#pragma once

#include <emmintrin.h>

#include "backends/cpu/pairs.h"

namespace raylign::detail::cpu {
namespace {

/// Two pairs in one register.
inline __m128 two_pairs(const float* a, const float* b) {
    const __m128 low = _mm_castsi128_ps(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(a)));
    return _mm_loadh_pi(low, reinterpret_cast<const __m64*>(b));
}

template <>
struct Pairs<xsimd::sse2> {
    using Floats = Lanes<xsimd::sse2>::Floats;
    using Ints = Lanes<xsimd::sse2>::Ints;

    static void load(const float* voxels, const Ints& index, Floats& first, Floats& second) {
        alignas(16) std::int32_t i[4];
        index.store_aligned(i);
        const __m128 a = two_pairs(voxels + i[0], voxels + i[1]), b = two_pairs(voxels + i[2], voxels + i[3]);
        first = _mm_shuffle_ps(a, b, _MM_SHUFFLE(2, 0, 2, 0));
        second = _mm_shuffle_ps(a, b, _MM_SHUFFLE(3, 1, 3, 1));
    }
    static void load(const std::int16_t* voxels, const Ints& index, Floats& first, Floats& second) {
        alignas(16) std::int32_t i[4];
        index.store_aligned(i);
        const auto pair = [&](int lane) {
            std::int32_t both;
            __builtin_memcpy(&both, voxels + i[lane], sizeof(both));
            return both;
        };
        const __m128i pairs = _mm_setr_epi32(pair(0), pair(1), pair(2), pair(3));
        first = _mm_cvtepi32_ps(_mm_srai_epi32(_mm_slli_epi32(pairs, 16), 16));
        second = _mm_cvtepi32_ps(_mm_srai_epi32(pairs, 16));
    }
};

}  // namespace
}  // namespace raylign::detail::cpu

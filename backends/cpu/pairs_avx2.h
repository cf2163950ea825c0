#pragma once

#include <immintrin.h>

#include "backends/cpu/pairs.h"

namespace raylign::detail::cpu {
namespace {

/// Two pairs in each half of a register.
inline __m256 four_pairs(const float* a, const float* b, const float* c, const float* d) {
    const auto two = [](const float* p, const float* q) {
        const __m128 low = _mm_castsi128_ps(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p)));
        return _mm_loadh_pi(low, reinterpret_cast<const __m64*>(q));
    };
    return _mm256_insertf128_ps(_mm256_castps128_ps256(two(a, b)), two(c, d), 1);
}

/// Four pairs of int16 voxels, one a lane.
inline __m128i four_pairs(const std::int16_t* a, const std::int16_t* b, const std::int16_t* c, const std::int16_t* d) {
    const auto everywhere = [](const std::int16_t* p) {
        int bits;
        __builtin_memcpy(&bits, p, sizeof(bits));
        return _mm_set1_epi32(bits);
    };
    return _mm_blend_epi32(_mm_blend_epi32(everywhere(a), everywhere(b), 0b1010),
                           _mm_blend_epi32(everywhere(c), everywhere(d), 0b1010), 0b1100);
}

/// Plain loads: AVX2's own gathers are no faster than the loads that they are made of.
template <>
struct Pairs<xsimd::fma3<xsimd::avx2>> {
    using Floats = Lanes<xsimd::fma3<xsimd::avx2>>::Floats;
    using Ints = Lanes<xsimd::fma3<xsimd::avx2>>::Ints;

    static void load(const float* voxels, const Ints& index, Floats& first, Floats& second) {
        alignas(32) std::int32_t i[8];
        index.store_aligned(i);
        const __m256 a = four_pairs(voxels + i[0], voxels + i[1], voxels + i[4], voxels + i[5]);
        const __m256 b = four_pairs(voxels + i[2], voxels + i[3], voxels + i[6], voxels + i[7]);
        first = _mm256_shuffle_ps(a, b, _MM_SHUFFLE(2, 0, 2, 0));
        second = _mm256_shuffle_ps(a, b, _MM_SHUFFLE(3, 1, 3, 1));
    }
    static void load(const std::int16_t* voxels, const Ints& index, Floats& first, Floats& second) {
        alignas(32) std::int32_t i[8];
        index.store_aligned(i);
        const __m256i pairs = _mm256_setr_m128i(four_pairs(voxels + i[0], voxels + i[1], voxels + i[2], voxels + i[3]),
                                                four_pairs(voxels + i[4], voxels + i[5], voxels + i[6], voxels + i[7]));
        first = _mm256_cvtepi32_ps(_mm256_srai_epi32(_mm256_slli_epi32(pairs, 16), 16));
        second = _mm256_cvtepi32_ps(_mm256_srai_epi32(pairs, 16));
    }
};

}  // namespace
}  // namespace raylign::detail::cpu

#pragma once

#include "backends/cpu/lanes.h"

namespace raylign::detail::cpu {
namespace {

/// Loads voxels[index] and voxels[index + 1] for every lane. Neighbours come in one load: half the loads of two
/// gathers. Each instruction set has its own way (pairs_*.h); this one is for those without.
template <class Arch>
struct Pairs {
    using Floats = typename Lanes<Arch>::Floats;
    using Ints = typename Lanes<Arch>::Ints;

    static void load(const float* voxels, const Ints& index, Floats& first, Floats& second) {
        first = Floats::gather(voxels, index);
        second = Floats::gather(voxels + 1, index);
    }
    static void load(const std::int16_t* voxels, const Ints& index, Floats& first, Floats& second) {
        alignas(64) std::int32_t i[Ints::size];
        alignas(64) float values[2][Ints::size];
        index.store_aligned(i);
        for (unsigned lane = 0; lane < Ints::size; ++lane) {
            values[0][lane] = voxels[i[lane]];
            values[1][lane] = voxels[i[lane] + 1];
        }
        first = Floats::load_aligned(values[0]);
        second = Floats::load_aligned(values[1]);
    }
};

}  // namespace
}  // namespace raylign::detail::cpu

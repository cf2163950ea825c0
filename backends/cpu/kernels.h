#pragma once

#include "backends/cpu/band_derivatives_kernel.h"
#include "backends/cpu/joseph_kernel.h"
#include "backends/cpu/trilinear_derivatives_kernel.h"

namespace raylign::cpu {
namespace {

template <class Arch>
constexpr KernelTable make_kernel_table(const char* name) {
    constexpr std::size_t joseph_bytes = sizeof(JosephPacket<Arch>),
                          trilinear_bytes = sizeof(TrilinearPacket<Arch>) + sizeof(TrilinearSlopes<Arch>);
    return {name,
            (joseph_bytes > trilinear_bytes ? joseph_bytes : trilinear_bytes) * Lanes<Arch>::packets_per_tile,
            {&Joseph<Arch, float, Order::value>::cast, &Joseph<Arch, std::int16_t, Order::value>::cast},
            {&Trilinear<Arch, float>::cast, &Trilinear<Arch, std::int16_t>::cast},
            {&Joseph<Arch, float, Order::derivatives>::cast, &Joseph<Arch, std::int16_t, Order::derivatives>::cast},
            {&TrilinearDerivatives<Arch, float>::cast, &TrilinearDerivatives<Arch, std::int16_t>::cast},
            &Band<Arch>::sum,
            &BandDerivatives<Arch>::sum};
}

}  // namespace
}  // namespace raylign::cpu

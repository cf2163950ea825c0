#pragma once

#include "backends/cpu/band_derivatives_kernel.h"
#include "backends/cpu/joseph_kernel.h"
#include "backends/cpu/trilinear_kernel.h"

namespace raylign::detail::cpu {
namespace {

template <class Arch>
constexpr KernelTable make_kernel_table(const char* name) {
    using Parts = TrilinearFootprint<Arch>;
    constexpr std::size_t joseph_bytes = sizeof(JosephPacket<Arch>),
                          trilinear_bytes = sizeof(TrilinearPacket<Arch>) * Parts::most_parts;
    using Short = std::int16_t;
    constexpr Order kValue = Order::value, kSlopes = Order::derivatives;
    return {name,
            (joseph_bytes > trilinear_bytes ? joseph_bytes : trilinear_bytes) * Lanes<Arch>::packets_per_tile,
            Footprint<Arch>::storage,
            Parts::available,
            {&Joseph<Arch, float, kValue>::cast, &Joseph<Arch, Short, kValue>::cast},
            {&Trilinear<Arch, float, kValue>::cast, &Trilinear<Arch, Short, kValue>::cast},
            {&Joseph<Arch, float, kSlopes>::cast, &Joseph<Arch, Short, kSlopes>::cast},
            {&Trilinear<Arch, float, kSlopes>::cast, &Trilinear<Arch, Short, kSlopes>::cast},
            &Band<Arch>::sum,
            &BandDerivatives<Arch>::sum};
}

}  // namespace
}  // namespace raylign::detail::cpu

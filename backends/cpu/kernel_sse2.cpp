// The kernels for SSE2, which every x86-64 has.
#include "backends/cpu/kernels.h"
#include "backends/cpu/pairs_sse2.h"

namespace raylign::detail::cpu {

extern const KernelTable kSse2Kernels;  // read by kernel_dispatch.cpp
constinit const KernelTable kSse2Kernels = make_kernel_table<xsimd::sse2>("sse2");

}  // namespace raylign::detail::cpu

// The kernels for AVX2 with FMA.
#include "backends/cpu/footprint_avx2.h"
#include "backends/cpu/kernels.h"
#include "backends/cpu/pairs_avx2.h"

namespace raylign::detail::cpu {

extern const KernelTable kAvx2Kernels;  // read by kernel_dispatch.cpp
constinit const KernelTable kAvx2Kernels = make_kernel_table<xsimd::fma3<xsimd::avx2>>("avx2");

}  // namespace raylign::detail::cpu

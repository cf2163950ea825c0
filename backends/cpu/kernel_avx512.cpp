// The kernels for AVX-512 F, CD, DQ, BW and VL.
#include "backends/cpu/footprint_avx512.h"
#include "backends/cpu/kernels.h"
#include "backends/cpu/pairs_avx512.h"
#include "backends/cpu/trilinear_avx512.h"

namespace raylign::detail::cpu {

extern const KernelTable kAvx512Kernels;  // read by kernel_dispatch.cpp
constinit const KernelTable kAvx512Kernels = make_kernel_table<xsimd::avx512bw>("avx512");

}  // namespace raylign::detail::cpu

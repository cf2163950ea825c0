// The kernels for NEON of 64-bit ARM.
#include "backends/cpu/footprint_neon.h"
#include "backends/cpu/kernels.h"
#include "backends/cpu/pairs_neon.h"

namespace raylign::detail::cpu {

extern const KernelTable kNeonKernels;  // read by kernel_dispatch.cpp
constinit const KernelTable kNeonKernels = make_kernel_table<xsimd::neon64>("neon");

}  // namespace raylign::detail::cpu

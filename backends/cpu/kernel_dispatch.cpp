#include "backends/cpu/kernel_dispatch.h"

#include <cstdlib>
#include <span>

#include "backends/cpu/cpu_backend.h"
#include "core/base/error.h"

namespace raylign {
namespace cpu {

// Asked of the compiler's run-time library: xsimd 8.1 reads SSE2 from the wrong bit and never asks whether the system
// saves the wide registers (P1 in models.md).
#if defined(__x86_64__)
extern const KernelTable kAvx512Kernels, kAvx2Kernels, kSse2Kernels;
namespace {
bool has_avx512() {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512cd") &&
           __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("fma");
}
bool has_avx2() { return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); }
}  // namespace
#else
extern const KernelTable kNeonKernels;
#endif

namespace {

struct Entry {
    const KernelTable* kernels;
    bool (*available)();
};

/// Best first.
constexpr Entry kEntries[] = {
#if defined(__x86_64__)
    {&kAvx512Kernels, has_avx512},
    {&kAvx2Kernels, has_avx2},
    {&kSse2Kernels, [] { return true; }},
#else
    {&kNeonKernels, [] { return true; }},
#endif
};

}  // namespace

const KernelTable& choose_kernels(const std::string& name) {
    std::string wanted = name, where;
    if (wanted.empty()) {
        if (const char* from_environment = std::getenv("RAYLIGN_INSTRUCTION_SET")) {
            wanted = from_environment;
            where = "RAYLIGN_INSTRUCTION_SET";
        }
    }
    std::string valid;
    for (const Entry& entry : kEntries) {
        valid += (valid.empty() ? "" : ", ") + std::string(entry.kernels->name);
        if (wanted.empty() ? entry.available() : wanted == entry.kernels->name) {
            if (entry.available()) return *entry.kernels;
            throw Error("instruction set " + wanted + ": this processor does not have it", ErrorKind::unavailable);
        }
    }
    throw bad_value("instruction set", wanted, "one of " + valid, where);
}

}  // namespace cpu

std::vector<InstructionSetStatus> cpu_instruction_sets() {
    std::vector<InstructionSetStatus> list;
    for (const cpu::Entry& entry : cpu::kEntries) list.push_back({entry.kernels->name, entry.available()});
    return list;
}

}  // namespace raylign

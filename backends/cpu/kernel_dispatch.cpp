#include "backends/cpu/kernel_dispatch.h"

#include <cstdlib>
#include <span>

#include "backends/cpu/cpu_backend.h"
#include "core/base/error.h"

namespace raylign::detail {
namespace cpu {

// Asked of the compiler's run-time library: xsimd 8.1 reads SSE2 from the wrong bit and never asks whether the system
// saves the wide registers.
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

struct KernelEntry {
    InstructionSet set;
    const KernelTable* kernels;
    bool (*available)();
};

/// Best first.
constexpr KernelEntry kEntries[] = {
#if defined(__x86_64__)
    {InstructionSet::avx512, &kAvx512Kernels, has_avx512},
    {InstructionSet::avx2, &kAvx2Kernels, has_avx2},
    {InstructionSet::sse2, &kSse2Kernels, [] { return true; }},
#else
    {InstructionSet::neon, &kNeonKernels, [] { return true; }},
#endif
};

std::optional<InstructionSet> from_environment() {
    const char* const name = std::getenv("RAYLIGN_INSTRUCTION_SET");
    if (name == nullptr || *name == 0) return std::nullopt;
    std::string valid;
    for (const KernelEntry& entry : kEntries) {
        if (instruction_set_name(entry.set) == name) return entry.set;
        valid += (valid.empty() ? "one of " : ", ") + std::string(instruction_set_name(entry.set));
    }
    throw bad_value("instruction set", name, valid, "RAYLIGN_INSTRUCTION_SET");
}

}  // namespace

const KernelTable& choose_kernels(std::optional<InstructionSet> wanted) {
    if (!wanted) wanted = from_environment();
    for (const KernelEntry& entry : kEntries) {
        if (wanted ? *wanted != entry.set : !entry.available()) continue;
        if (entry.available()) return *entry.kernels;
        throw Error(
            "instruction set " + std::string(instruction_set_name(entry.set)) + ": this processor does not have it",
            ErrorKind::unavailable);
    }
    throw Error("instruction set " + std::string(instruction_set_name(*wanted)) + ": this build has no kernels for it",
                ErrorKind::unavailable);
}

}  // namespace cpu

std::vector<InstructionSetStatus> cpu_instruction_sets() {
    std::vector<InstructionSetStatus> list;
    for (const cpu::KernelEntry& entry : cpu::kEntries) list.push_back({entry.set, entry.available()});
    return list;
}

}  // namespace raylign::detail

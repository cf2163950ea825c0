#pragma once

#include <memory>
#include <vector>

#include "raylign/backends.h"

namespace raylign::detail {

/// Instruction sets that this build has a kernel for, best first, and whether this processor has them.
[[nodiscard]] std::vector<InstructionSetStatus> cpu_instruction_sets();

/// The multithreaded SIMD backend. Throws Error for a bad thread count or an unknown instruction set in the environment
/// and, kind unavailable, for an instruction set that this processor or this build does not have.
[[nodiscard]] std::unique_ptr<Backend> make_cpu_backend(const CpuOptions& options);

}  // namespace raylign::detail

#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/backend.h"

namespace raylign {

struct CpuOptions {
    int threads = 0;  ///< 0 = all cores this process may use; in [0, 1024]
    std::string
        instruction_set;  ///< "" = the environment's RAYLIGN_INSTRUCTION_SET, else the best that the processor has
    std::string storage =
        "float32";  ///< or "int16": half the memory, voxels rounded to max / 32767 (see volume_layout.h)
};

/// Instruction sets that this build has a kernel for, best first, and whether this processor has them.
struct InstructionSetStatus {
    std::string name;
    bool available = false;
};
[[nodiscard]] std::vector<InstructionSetStatus> cpu_instruction_sets();

/// The multithreaded SIMD engine. Throws Error for an unknown instruction set or a bad thread count, and, kind
/// unavailable, for an instruction set that this processor does not have.
[[nodiscard]] std::unique_ptr<Backend> make_cpu_backend(const CpuOptions& options);

}  // namespace raylign

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
    /// "float32"; "int16": half the memory, voxels rounded to max / 32767 (see volume_layouts.h); "auto": float32 where
    /// the engine's copies stay within max_volume_bytes, else int16.
    std::string storage = "auto";
    std::size_t max_volume_bytes = std::size_t{2} << 30;  ///< read by "auto"; with the caller's volume, 3 of 4 GiB
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

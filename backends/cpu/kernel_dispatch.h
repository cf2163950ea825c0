#pragma once

#include <optional>

#include "backends/cpu/kernel_types.h"
#include "raylign/backends.h"

namespace raylign::detail::cpu {

/// The kernels of the instruction set; none takes the environment's RAYLIGN_INSTRUCTION_SET, else the best that this
/// processor has. Throws Error for a name in the environment that is none, and of kind unavailable for a set that this
/// processor or this build lacks.
[[nodiscard]] const KernelTable& choose_kernels(std::optional<InstructionSet> wanted);

}  // namespace raylign::detail::cpu

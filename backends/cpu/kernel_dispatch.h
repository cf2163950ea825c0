#pragma once

#include <string>

#include "backends/cpu/kernel_types.h"

namespace raylign::cpu {

/// The kernels of the instruction set of that name; "" takes the environment's RAYLIGN_INSTRUCTION_SET, else the best
/// that this processor has. Throws Error for a name that this build does not know (the message lists the valid ones),
/// and of kind unavailable for a set that this processor lacks.
[[nodiscard]] const KernelTable& choose_kernels(const std::string& name);

}  // namespace raylign::cpu

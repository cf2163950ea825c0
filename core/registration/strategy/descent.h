#pragma once

#include <cstddef>

#include "core/registration/level/run.h"

namespace raylign::detail {

/// Whether the DRR at the start must reach every view: where nothing is searched, a start beyond them is a mistake.
enum class StartCheck { none, overlap };

/// Coarse to fine from the start, by the run's method; the coarsest levels may be left out.
void descend(Run& run, Content content, StartCheck check, std::ptrdiff_t left_out = 0);

}  // namespace raylign::detail

#pragma once

#include "core/registration/level/run.h"

namespace raylign::detail {

/// Where a whole in several views is explained poorly: whether it is explained far better in views that are magnified
/// by 0.88 to 1.13 (about their principal points), on the coarsest level, each descended in from the result. Then sets
/// run.magnification, refined by one step there (trust/magnification.h): that step alone, taken from the result, sees
/// no more than a few percent.
void look_for_magnification(Run& run);

}  // namespace raylign::detail

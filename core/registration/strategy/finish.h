#pragma once

#include "core/registration/level/level.h"

namespace raylign::detail {

/// Finishes on the finest level, or on one of the same size with a fine filter where the volume as a whole leaves
/// something unexplained: scatter, metal and other contrast bias wide gradients (0.7 mm on the chest CT) far more than
/// fine ones (0.1 mm). `coarser` may be null.
void finish_as_it_needs(Run& run, Level& level, Level* coarser);

/// True where more than noise is unexplained, so that weights which count it less are worth their time.
[[nodiscard]] bool wants_robust_weights(const Run& run, Level& level);

}  // namespace raylign::detail

#pragma once

#include "core/registration/level/run.h"

namespace raylign::detail {

/// Finds the pose: as which content, from which starts, on which levels. Writes into the run's result; the verdict is
/// passed elsewhere (trust/verdict.h). Throws RunStopped, and Error as register_volume does.
void find_pose(Run& run);

}  // namespace raylign::detail

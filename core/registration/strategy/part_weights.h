#pragma once

#include "core/registration/level/level.h"

namespace raylign::detail {

/// Gives the level's pixels the weights of a part whose place is about known: those near it only, gradients evened out.
void weigh_part(Level& level, const RigidTransform& world_from_ct);

}  // namespace raylign::detail

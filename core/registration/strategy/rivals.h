#pragma once

#include <optional>

#include "core/registration/level/run.h"

namespace raylign::detail {

/// Whether another pose explains the X-rays as well as the one that a descent has found for a whole: starts around it
/// are refined on the coarsest level, and those that end elsewhere and cost little are compared with it on the next.
/// Turned by 20 degrees about the first view's axes and shifted by a quarter of the object's radius; for one view also
/// what that confuses: depth, turns of 40 degrees about the in-plane axes, and the mirror images of the
/// object's orientation through the image plane (turned so that one principal axis of the object points the other way
/// as well: a nearly symmetric object looks the same). Where a view is poorly explained, 512 random poses farther
/// around, too, the best 24 refined. Fills result.search (starts, refined, agreeing, cost, rivals). Gives the pose that
/// explains the X-rays better, if there is one.
[[nodiscard]] std::optional<RigidTransform> look_for_rivals(Run& run);

}  // namespace raylign::detail

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

/// Where a cut CT explains too little of what it should explain: a pose that explains more on the second-coarsest
/// level, from the start once more and from 64 poses around it. The coarsest one, on which little more than the cut is
/// to be seen, may have its minimum 14 mm off, whence the next goes astray; so go on from there without it.
[[nodiscard]] std::optional<RigidTransform> from_the_start_again(Run& run);

}  // namespace raylign::detail

#pragma once

#include <optional>

#include "core/registration/level/level.h"

namespace raylign::detail {

// Which pixels of a level are compared. Chosen at a pose and then fixed while poses are compared.

/// What the DRR of the CT as it is explains at a pose, apart from what its cut sides cut off and of that.
struct CutCosts {
    double within = 0, beyond = 0;
};
/// None where no side is cut, or where one of the two is hardly shown.
[[nodiscard]] std::optional<CutCosts> costs_about_the_cut(Run& run, Level& level, const RigidTransform& world_from_ct);

/// For a whole: all pixels, but, where the X-ray shows more than the CT, for those whose rays meet what was cut off
/// (object/cut_faces.h), as far as the filter reaches: the X-ray has tissue there and the DRR an edge that no X-ray
/// shows. Nothing is left out where too few pixels would remain.
void weigh_whole(Run& run, Level& level, const RigidTransform& world_from_ct);

/// The same with gradients evened out.
void weigh_whole_evenly(Run& run, Level& level, const RigidTransform& world_from_ct);

/// For a part whose place is about known: the pixels near it only, without those whose rays meet what was cut off,
/// gradients evened out.
void weigh_part(Run& run, Level& level, const RigidTransform& world_from_ct);

}  // namespace raylign::detail

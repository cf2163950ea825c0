#pragma once

#include <span>
#include <vector>

#include "core/registration/level/level.h"
#include "core/registration/trust/pose_sums.h"
#include "core/registration/trust/view_agreement.h"

namespace raylign::detail {

/// What one view says where it is asked alone.
struct ViewAlone {
    Twist moved = Twist::Zero();  ///< (rad, mm) of the object about its centre in world, from the result to that place
    ViewSums sums;                ///< there
};

/// Each view alone near the result, under robust weights of its own. Weights from the pose of all views together count
/// edges less where the views contradict each other, and hide more than half of what one step there would tell: the
/// second camera turned by 1 degree seemed turned by 0.4. A few Gauss-Newton steps with renewed weights, held by the
/// wide prior of view_agreement.h in the directions that a view does not see. `level`: of a whole, whose weights become
/// those before robust ones; nothing else may need them afterwards. `evidence`: at the result, for its noise. Empty
/// where any of it is not estimated.
[[nodiscard]] std::vector<ViewAlone> views_alone(Run& run, Level& level, std::span<const ViewEvidence> evidence);

}  // namespace raylign::detail

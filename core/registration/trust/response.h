#pragma once

#include "core/registration/trust/pose_sums.h"

namespace raylign::detail {

// Whether an object's contrast in the X-ray is in proportion to that in its DRR. Scatter, glare, a camera's black level
// and beam hardening all compress it where the object is dense, the more so the more tissue is before and behind it,
// which the DRR of a part does not know: of exp(-I - I_0) + s, I_0 of the tissue and s of what is added, the logarithm
// is that of f + (1 - f) exp(-I), up to a constant and a factor near 1, f = s / (s + exp(-I_0)). As View::ceiling.
// Compressed contrast looks larger, which with one view is nearer.

/// d/df of a DRR that shows I as -log(f + (1 - f) exp(-I)), from what it shows: -(1 - exp(-I)) / (f + (1 - f) exp(-I)).
/// f in [0, 1).
[[nodiscard]] Image floor_derivative(Image shown, double floor);

/// The step in f of one Gauss-Newton step in the pose and f. `sums`: of the only view, with floor_derivative.
[[nodiscard]] double floor_step(const ViewSums& sums);

}  // namespace raylign::detail

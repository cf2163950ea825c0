#pragma once

#include "core/registration/trust/model_error.h"
#include "core/registration/trust/pose_sums.h"

namespace raylign::detail {

// Whether an object's contrast in the X-ray is in proportion to that in its DRR. Beam hardening, scatter, glare and a
// camera's black level all compress it where the object is dense, the more so the more tissue is before and behind it,
// which the DRR of a part does not know. That shows in the X-ray; model_error.h only says what ordinary amounts do.

/// d/dh of a DRR I that is compressed to I / (1 + h I), at h = 0: -I^2.
[[nodiscard]] Image response_derivative(const Image& drr, std::size_t view);

/// How far it has moved the pose that the only view's X-ray shows the object compressed: h, fitted together with the
/// pose on the finest level, times how a pose that ignores h follows it on the coarser one, whose steps are what all
/// pixels agree on. Of models M = D + J x + h S: x = (J^T J)^-1 J^T S h. Both sums with response_derivative.
[[nodiscard]] ModelShift response_shift(const ViewSums& finest);

}  // namespace raylign::detail

#pragma once

#include <string>

#include "core/backend.h"

namespace raylign::detail {

/// How far two backends may be apart, and why so far.
struct Tolerance {
    double value = 0;
    std::string reason;
};

/// What `compare` allows between the oracle and another backend.
struct CompareTolerances {
    Tolerance image_share;        ///< largest pixel difference, of the image's maximum
    Tolerance sums_share;         ///< of the sums of squares
    Tolerance cost;               ///< absolute
    Tolerance gradient_share;     ///< of the gradient's length; and of the Gauss-Newton matrix' norm
    Tolerance differences_share;  ///< analytic gradient against central differences of the oracle's cost
    Tolerance sweep_mm_or_deg;    ///< place of a minimum
    Tolerance pose_mtre_mm;       ///< final poses from one start
};

/// By what the backend says of itself: float or 16-bit voxels, exact interpolation or texture filters.
[[nodiscard]] CompareTolerances compare_tolerances(const BackendInfo& info);

}  // namespace raylign::detail

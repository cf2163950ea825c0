#pragma once

#include <string>

#include "core/backend.h"

namespace raylign::detail {

/// How far two backends may be apart, and why so far.
struct Tolerance {
    double value = 0;
    std::string reason;
};

/// Texture units of GPUs interpolate with fractions of 8 bits: a sample is off by 2^-9 of the step between two voxels
/// along each axis, and those of a ray in step with the lattice all alike. Images, as a share of their maximum, costs,
/// and final poses [mm mTRE]: twice what the same rounding in a shader gives (RAYLIGN_GL_FILTER_BITS=8): 5.0e-4 with
/// joseph, 4.7e-4 with trilinear for a spine of 4 mm voxels, 1.7e-4 for a chest of 1.5 mm.
inline constexpr double kFilterBitsShare = 1e-3;
inline constexpr double kFilterBitsCost = 1e-4;
inline constexpr double kFilterBitsPoseMtre_mm = 0.02;

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
/// The same where the backend chose how voxels are kept (storage "auto"): by what its session keeps.
[[nodiscard]] CompareTolerances compare_tolerances(BackendInfo info, const std::string& volume_layout);

}  // namespace raylign::detail

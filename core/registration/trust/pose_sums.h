#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

#include "core/backend.h"
#include "core/registration/trust/distortion.h"
#include "core/registration/trust/magnification.h"

namespace raylign::detail {

/// Groups of pixels that are left out in turn.
inline constexpr int kGroups = 16;
/// The group of each block of a view: its box of pixels with weight is cut into 8 x 8 blocks, and every group has some
/// in each half of the rows and columns.
[[nodiscard]] int group_of(int block_x, int block_y);

/// One view at one pose, all from one DRR with its derivatives, with the weights that the session uses.
struct ViewSums {
    Linearization all;                                  ///< as Session::linearize_views
    std::array<Linearization, kGroups> without;         ///< where the pixels of a group have no weight
    bool leaves_enough = true;                          ///< no group holds nearly all pixels
    double information = 1;                             ///< share of the curvature that it really has (pose_sums)
    std::array<Linearization, kDistortions> distorted;  ///< where the X-ray is the DRR distorted
    /// With a seventh parameter: of all pixels, then without each group. Empty where it was not asked for.
    std::vector<ScaledLinearization> scaled;
};

/// Of the views in the cost.
[[nodiscard]] std::vector<double> shares_of(const Session& session);

/// Sums in double on the host, by group of pixels: leaving a group out is subtracting its sums. `before_view` may throw
/// to stop. `seventh`: empty where nothing but the pose is asked for. Throws Error as Session::linearize does.
/// `robust`: the robust weights (robust_weights.h) that are part of the session's, one image per view; empty: none.
///
/// A Gauss-Newton matrix promises more than a view knows that correlates weakly. Of 1 - N = 1 - a^T b, b of unit norm,
/// the second derivative is N |db|^2 to the order that Gauss-Newton keeps, which takes N for 1; and robust weights w
/// follow the pose: an M-estimator's curvature counts psi'(r) of each pixel, not w = psi(r) / r [Huber81]. With
/// w = (1 + u^2)^-2, psi' / w = 4 sqrt(w) - 3. So
///   information = max(N, 0.05) sum w max(4 sqrt(w_robust) - 3, 0) |J|^2 / sum w |J|^2,
/// J the derivatives by translation. Measured on a vertebra in a chest: N = 0.35 and 0.57 of it.
[[nodiscard]] std::vector<ViewSums> pose_sums(Session& session, const RigidTransform& world_from_ct,
                                              const Eigen::Vector3d& centre_ct_mm,
                                              const std::function<void()>& before_view,
                                              const SeventhDerivative& seventh = {},
                                              std::span<const Image> robust = {});

}  // namespace raylign::detail

#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "core/registration/level/run.h"
#include "raylign/result.h"

namespace raylign::detail {

/// Object and cameras as they fit best together.
struct RefinedViews {
    RigidTransform world_from_ct;
    std::vector<RigidTransform> moved;        ///< of each camera in world
    std::vector<ViewCorrection> corrections;  ///< the same as numbers, with sigmas; not estimated for those that stay
    /// Of the object's twist (rad, mm) about its centre, cameras being as unsure as they are.
    Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/// Which cameras may move, and how far.
struct CameraFreedom {
    std::vector<bool> moves;  ///< per view; at least one stays or the prior shares the corrections out
    double prior_deg, prior_mm;
};

/// Solves for object and cameras from a finished result (JointProblem), on its levels but the coarsest, coarse to fine;
/// at the end with the filter and the robust weights that the result was finished with. The noise of each view is
/// estimated on each level (view_evidence). `run`: of the same views and volume. Empty where a view's noise cannot be
/// estimated.
[[nodiscard]] std::optional<RefinedViews> refine_views(Run& run, const RegistrationResult& found,
                                                       const CameraFreedom& freedom);

/// The views with their cameras moved.
[[nodiscard]] std::vector<View> with_moved_cameras(std::span<const View> views, std::span<const RigidTransform> moved);

/// A view that fits the others badly by one step is looked at closely: how its camera would have to stand if it may be
/// anywhere near, solved from coarse to fine. Replaces its correction in `result`; what that cost is counted there.
void look_closer(const Run& run, RegistrationResult& result);

/// Adds the work of another run to the account: counters, timing.
void add_work(RegistrationResult& sum, const RegistrationResult& other);

}  // namespace raylign::detail

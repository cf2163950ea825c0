#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "core/registration/trust/pose_sums.h"
#include "raylign/rigid_transform.h"

namespace raylign::detail {

/// How far something that a DRR does not model moves the pose.
struct ModelShift {
    std::string_view what;
    double share = 1;             ///< of that something, the most that the residual has room for
    Twist twist = Twist::Zero();  ///< (rad, mm) about the object's centre, in world
};

/// A detector's blur, scatter and beam hardening move edges and change their strength; a DRR has none of them, and all
/// groups of pixels are biased alike, so that no jackknife sees it. Each is laid over the DRR at the pose
/// (distortion.h), and one Gauss-Newton step from the pose, with that as the X-ray, tells the bias. Where it would
/// leave more unexplained than the real X-ray does, there is less of it: the step times the root of the ratio of the
/// costs. `residual`: the cost at the pose. Little residual has hardly room for scatter, much has more of it than of
/// hardening, which compresses contrast alike: the lesser of the two is left out. `shares`: of the views in the cost.
[[nodiscard]] std::vector<ModelShift> model_shifts(std::span<const ViewSums> views, std::span<const double> shares,
                                                   double residual);

/// The same for each view alone: how far its own image would move the object. A direction that a view hardly sees is
/// moved far. The residual is that of the view.
[[nodiscard]] std::vector<std::vector<ModelShift>> model_shifts_of_views(std::span<const ViewSums> views);

/// One view that saturates shows hardly more than an outline, and what puts that off all around is depth: blur, voxels,
/// the part's manufacture, a camera's sdd. A size that is off by 0.2 % (half of what right cameras seemed to be
/// magnified by at most, magnification.cpp) is a depth off by as much. `from_source_mm`: the object's centre from the
/// source.
[[nodiscard]] ModelShift size_shift(const Eigen::Vector3d& from_source_mm);

}  // namespace raylign::detail

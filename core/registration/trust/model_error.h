#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "core/registration/level/level.h"

namespace raylign::detail {

/// How far something that a DRR does not model moves the pose.
struct ModelShift {
    std::string_view what;
    double share = 1;             ///< of that something, the most that the residual has room for
    Twist twist = Twist::Zero();  ///< (rad, mm) about the object's centre, in world
};

/// A detector's blur, scatter and beam hardening move edges and change their strength; a DRR has none of them, and all
/// groups of pixels are biased alike, so that no jackknife sees it. Each is laid over the DRR I at the pose,
///   blur       -log(G * exp(-I)),                              G a Gaussian of 0.6 pixels,
///   scatter    -log((exp(-I) + s S * exp(-I)) / (1 + s)),      s = 0.4, S a Gaussian of a tenth of the image's width,
///   hardening  I / (1 + 0.06 I),
/// amounts of ordinary X-rays; and one Gauss-Newton step from the pose, with that as the X-ray, tells the bias. Where
/// it would leave more unexplained than the real X-ray does, there is less of it: the step times the root of the ratio
/// of the costs. Uses the session's weights. `residual`: the level's cost at the pose. Little residual has hardly room
/// for scatter, much has more of it than of hardening, which compresses contrast alike: the lesser of the two is left
/// out.
[[nodiscard]] std::vector<ModelShift> model_shifts(Level& level, const RigidTransform& world_from_ct, double residual);

/// The same for each view alone: how far its own image would move the object. A direction that a view hardly sees is
/// moved far. `residuals`: the costs of the views at the pose, on this level.
[[nodiscard]] std::vector<std::vector<ModelShift>> model_shifts_of_views(Level& level,
                                                                         const RigidTransform& world_from_ct,
                                                                         std::span<const double> residuals);

}  // namespace raylign::detail

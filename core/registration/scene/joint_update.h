#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/registration/scene/scene_descent.h"

namespace raylign::detail {

/// Share of the variance of objects' errors that they have in common: what biases one (scatter, hardening, a camera)
/// biases all alike, and no joint tells (bench/README.md, "Several bones at once").
inline constexpr double kCommonError = 0.5;

/// What became of a joint's limit.
struct JointOutcome {
    JointMotion motion;    ///< at the poses found
    bool is_used = false;  ///< both ends were told well enough, and the X-rays do not contradict it
};

/// Brings in the joints' limits once each object has a pose and an expected error of its own. With x the objects'
/// twists from these poses, C their covariance (errors of two objects correlated by kCommonError), r the limits'
/// residuals and J their derivatives:
///   K = C J^T (J C J^T + 1)^-1,  x = -K r,  covariance = C - K J C.
/// An object that is doubted for another reason than a large expected error takes no part, nor do joints with it. A
/// joint whose r^T (J C J^T + 1)^-1 r exceeds what one in a thousand has is contradicted by the X-rays: it is not used,
/// and both its objects are doubted. Verdicts on the expected error are renewed. Returns an outcome per joint.
[[nodiscard]] std::vector<JointOutcome> settle_joints(const SceneDescent& scene, std::span<const std::string> names,
                                                      std::vector<RegistrationResult>& objects);

}  // namespace raylign::detail

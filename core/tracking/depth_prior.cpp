#include "core/tracking/depth_prior.h"

#include <cmath>

#include "core/registration/trust/confidence.h"
#include "raylign/rigid_transform.h"

namespace raylign::detail {
namespace {

constexpr double kContradicts = 3;  // standard deviations: chance does that in one frame of 370

}  // namespace

DepthPrior depth_like(const Eigen::Vector3d& before_mm, double sigma_mm, const Eigen::Vector3d& found_mm,
                      const Eigen::Vector3d& source_mm) {
    const Eigen::Vector3d axis = (found_mm - source_mm).normalized();
    return {axis, axis.dot(before_mm - found_mm), sigma_mm};
}

bool join_depth(RegistrationResult& result, const DepthPrior& prior, const Eigen::Vector3d& centre_ct_mm,
                double radius_mm) {
    Confidence& confidence = result.confidence;
    if (!confidence.is_estimated) return false;
    Twist depth = Twist::Zero();
    depth.tail<3>() = prior.axis_world;
    const Twist with_depth = confidence.covariance * depth;
    const double variance_mm2 = depth.dot(with_depth) + prior.sigma_mm * prior.sigma_mm;
    if (!(std::abs(prior.ahead_mm) <= kContradicts * std::sqrt(variance_mm2))) return false;
    const Twist gain = with_depth / variance_mm2;
    const Eigen::Vector3d centre_mm = result.world_from_ct * centre_ct_mm;
    result.world_from_ct = exp_about(gain * prior.ahead_mm, centre_mm) * result.world_from_ct;
    confidence.covariance -= gain * with_depth.transpose();
    summarise(confidence, radius_mm);
    split_by_depth(confidence, prior.axis_world);
    return true;
}

}  // namespace raylign::detail

#include "core/registration/trust/confidence.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/linear_algebra.h"

namespace raylign::detail {
namespace {

constexpr int kShiftPerView = 7;
constexpr double kLeastInformation = 0.02;

using Twists = Eigen::Matrix<double, 6, kGroups>;

/// One Gauss-Newton step per group left out. Groups are shifted from view to view, so that no part of the object is
/// left out of all.
Twists steps_without_groups(std::span<const ViewSums> views, std::span<const double> shares, bool by_information) {
    Twists steps;
    for (int group = 0; group < kGroups; ++group) {
        Linearization at;
        for (std::size_t v = 0; v < views.size(); ++v) {
            const int shifted = (group + (kGroups - kShiftPerView) * static_cast<int>(v % kGroups)) % kGroups;
            const Linearization& of_view = views[v].without[shifted];
            const double information = by_information ? std::max(kLeastInformation, views[v].information) : 1;
            at += {shares[v] * of_view.cost, shares[v] * of_view.gradient, shares[v] * information * of_view.curvature};
        }
        steps.col(group) = -solve_symmetric(at.curvature, at.gradient);
    }
    return steps;
}

}  // namespace

void summarise(Confidence& confidence, double radius_mm) {
    const Eigen::Matrix3d rotation = confidence.covariance.topLeftCorner<3, 3>();
    const Eigen::Matrix3d translation = confidence.covariance.bottomRightCorner<3, 3>();
    confidence.translation_mm = std::sqrt(translation.trace());
    confidence.rotation_deg = std::sqrt(rotation.trace()) * 180 / std::numbers::pi;
    // Mean of |w x p|^2 over a uniform ball: 2/5 r^2 |w|^2.
    confidence.rim_mm = std::sqrt(translation.trace() + 0.4 * radius_mm * radius_mm * rotation.trace());
    const PrincipalAxes principal = principal_axes(translation);
    confidence.weakest_direction = principal.axes.col(2);
    confidence.weakest_mm = std::sqrt(std::max(principal.values[2], 0.0));
    const PrincipalAxes turns = principal_axes(rotation);
    confidence.weakest_axis = turns.axes.col(2);
    confidence.weakest_deg = std::sqrt(std::max(turns.values[2], 0.0)) * 180 / std::numbers::pi;
}

Confidence jackknife(std::span<const ViewSums> views, std::span<const double> shares, double radius_mm,
                     double calibration, bool by_information) {
    Confidence confidence;
    if (!std::ranges::all_of(views, &ViewSums::leaves_enough)) return confidence;
    const Twists steps = steps_without_groups(views, shares, by_information);
    if (!steps.allFinite()) return confidence;
    const Twists deviations = steps.colwise() - steps.rowwise().mean();
    confidence.is_estimated = true;
    confidence.covariance = calibration * calibration * (kGroups - 1.0) / kGroups * deviations * deviations.transpose();
    summarise(confidence, radius_mm);
    return confidence;
}

void split_by_depth(Confidence& confidence, const Eigen::Vector3d& depth_axis) {
    if (!confidence.is_estimated) return;
    const Eigen::Matrix3d translation = confidence.covariance.bottomRightCorner<3, 3>();
    const double depth2 = std::max(0.0, depth_axis.dot(translation * depth_axis));
    confidence.in_depth_mm = std::sqrt(depth2);
    confidence.in_plane_mm = std::sqrt(std::max(0.0, confidence.rim_mm * confidence.rim_mm - depth2));
}

void add_model_error(Confidence& confidence, std::span<const ModelShift> shifts, double radius_mm) {
    if (!confidence.is_estimated) return;
    for (const ModelShift& shift : shifts) {
        confidence.covariance += kModelCalibration * kModelCalibration * shift.twist * shift.twist.transpose();
    }
    summarise(confidence, radius_mm);
}

}  // namespace raylign::detail

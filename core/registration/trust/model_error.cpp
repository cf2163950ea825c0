#include "core/registration/trust/model_error.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/linear_algebra.h"
#include "core/registration/policy.h"

namespace raylign::detail {
namespace {

constexpr double kSize = 0.002;

/// Of a residual: little has hardly room for scatter, much has more of it than of hardening.
std::array<Distortion, 2> distortions(double residual) {
    return {Distortion::blur, residual < kRobustFrom_cost ? Distortion::hardening : Distortion::scatter};
}

ModelShift shift_of(Distortion distortion, const Linearization& at, double residual) {
    const double share = at.cost > residual ? std::sqrt(std::max(residual, 0.0) / at.cost) : 1;
    return {distortion_name(distortion), share, share * Twist(-solve_symmetric(at.curvature, at.gradient))};
}

}  // namespace

std::vector<ModelShift> model_shifts(std::span<const ViewSums> views, std::span<const double> shares, double residual) {
    std::vector<ModelShift> shifts;
    for (const Distortion distortion : distortions(residual)) {
        Linearization at;
        for (std::size_t v = 0; v < views.size(); ++v) {
            const Linearization& of_view = views[v].distorted[static_cast<std::size_t>(distortion)];
            at += {shares[v] * of_view.cost, shares[v] * of_view.gradient, shares[v] * of_view.curvature};
        }
        shifts.push_back(shift_of(distortion, at, residual));
    }
    return shifts;
}

std::vector<std::vector<ModelShift>> model_shifts_of_views(std::span<const ViewSums> views) {
    double most = 0;
    for (const ViewSums& view : views) most = std::max(most, view.all.cost);
    std::vector<std::vector<ModelShift>> shifts(views.size());
    for (const Distortion distortion : distortions(most)) {
        for (std::size_t v = 0; v < views.size(); ++v) {
            const Linearization& at = views[v].distorted[static_cast<std::size_t>(distortion)];
            shifts[v].push_back(shift_of(distortion, at, views[v].all.cost));
        }
    }
    return shifts;
}

ModelShift size_shift(const Eigen::Vector3d& from_source_mm) {
    ModelShift shift{"size", 1, Twist::Zero()};
    shift.twist.tail<3>() = kSize * from_source_mm;
    return shift;
}

}  // namespace raylign::detail

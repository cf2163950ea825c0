#include "core/registration/trust/magnification.h"

#include <algorithm>
#include <cmath>

#include "core/base/linear_algebra.h"
#include "core/base/number_text.h"
#include "core/registration/trust/pose_sums.h"

namespace raylign::detail {
namespace {

/// Right cameras showed up to 0.004 on X-rays with blur, scatter and hardening, an sdd 3 % wrong 0.011 to 0.024.
constexpr double kLeastLog = 0.01;
constexpr double kLeastSigmas = 4;

/// Where the i-th and j-th parameters meet in JacobianSums::jacobian_jacobian, i <= j.
int upper(int i, int j) { return i * (11 - i) / 2 + j; }

/// With the column in place of the k-th derivative.
std::vector<JacobianSums> with_column(std::span<const JacobianSums> channels, std::span<const ColumnSums> columns,
                                      int k) {
    std::vector<JacobianSums> result(channels.begin(), channels.end());
    for (std::size_t c = 0; c < result.size(); ++c) {
        JacobianSums& sums = result[c];
        sums.jacobian[k] = columns[c].sum;
        sums.fixed_jacobian[k] = columns[c].fixed;
        sums.moving_jacobian[k] = columns[c].moving;
        for (int i = 0; i < 6; ++i) {
            const double meeting = i == k ? columns[c].squared : columns[c].jacobian[i];
            sums.jacobian_jacobian[upper(std::min(i, k), std::max(i, k))] = meeting;
        }
    }
    return result;
}

/// The last entry of the step that minimizes the sum over the views.
double log_of_step(std::span<const ScaledLinearization> views, std::span<const double> shares) {
    ScaledLinearization all;
    for (std::size_t v = 0; v < views.size(); ++v) {
        all.gradient += shares[v] * views[v].gradient;
        all.curvature += shares[v] * views[v].curvature;
    }
    return -solve_symmetric(Eigen::MatrixXd(all.curvature), Eigen::VectorXd(all.gradient))[6];
}

}  // namespace

ColumnSums& ColumnSums::operator+=(const ColumnSums& other) {
    sum += other.sum;
    fixed += other.fixed;
    moving += other.moving;
    squared += other.squared;
    for (std::size_t i = 0; i < jacobian.size(); ++i) jacobian[i] += other.jacobian[i];
    return *this;
}

Image magnification_derivative(const Image& drr, const Camera& camera) {
    const Eigen::Vector2d centre_px = camera.intrinsics_px.col(2).head<2>();
    Image derivative(drr.width, drr.height, 0);
    for (int y = 1; y + 1 < drr.height; ++y) {
        for (int x = 1; x + 1 < drr.width; ++x) {
            const double along_x = (drr(x + 1, y) - drr(x - 1, y)) / 2, along_y = (drr(x, y + 1) - drr(x, y - 1)) / 2;
            derivative(x, y) = static_cast<float>(-((x - centre_px.x()) * along_x + (y - centre_px.y()) * along_y));
        }
    }
    return derivative;
}

SeventhDerivative by_magnification(std::span<const View> views) {
    return [views](const Image& drr, std::size_t view) {
        return magnification_derivative(drr, views[view].geometry.camera);
    };
}

ScaledLinearization linearize_scaled(std::span<const JacobianSums> channels, std::span<const ColumnSums> columns) {
    const Linearization pose = linearize_view(channels);
    const Linearization last = linearize_view(with_column(channels, columns, 5));
    const Linearization first = linearize_view(with_column(channels, columns, 0));
    ScaledLinearization result;
    result.gradient << pose.gradient, last.gradient[5];
    result.curvature.topLeftCorner<6, 6>() = pose.curvature;
    for (int i = 0; i < 5; ++i) result.curvature(i, 6) = result.curvature(6, i) = last.curvature(i, 5);
    result.curvature(5, 6) = result.curvature(6, 5) = first.curvature(0, 5);
    result.curvature(6, 6) = last.curvature(5, 5);
    return result;
}

std::optional<Magnification> magnification(std::span<const ViewSums> views, std::span<const double> shares,
                                           double calibration) {
    if (views.size() < 2) return std::nullopt;
    for (const ViewSums& view : views) {
        if (!view.leaves_enough || view.scaled.empty()) return std::nullopt;
    }
    const auto log_from = [&](std::size_t which) {
        std::vector<ScaledLinearization> linearized;
        for (const ViewSums& view : views) linearized.push_back(view.scaled[which]);
        return log_of_step(linearized, shares);
    };
    std::array<double, kGroups> without;
    double mean = 0, scatter = 0;
    for (int g = 0; g < kGroups; ++g) mean += without[g] = log_from(1 + g);
    mean /= kGroups;
    for (const double log : without) scatter += (log - mean) * (log - mean);
    const Magnification found{log_from(0), calibration * std::sqrt((kGroups - 1.0) / kGroups * scatter)};
    if (!std::isfinite(found.log) || !std::isfinite(found.sigma)) return std::nullopt;
    return found;
}

std::optional<std::string> magnification_doubt(const std::optional<Magnification>& magnification) {
    if (!magnification) return std::nullopt;
    const auto [log, sigma] = *magnification;
    if (!(std::abs(log) > std::max(kLeastLog, kLeastSigmas * sigma))) return std::nullopt;
    return "all views fit best if magnified by " + fixed(std::exp(log), 3) + " (within " + fixed(sigma, 3) +
           "): are sdd, sad, pixel pitch and the CT's spacing right?";
}

}  // namespace raylign::detail

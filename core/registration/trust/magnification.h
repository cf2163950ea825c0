#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/registration/level/run.h"
#include "core/similarity/linearization.h"
#include "raylign/camera.h"
#include "raylign/image.h"
#include "raylign/view.h"

namespace raylign::detail {

struct ViewSums;

// Whether all views would fit better larger or smaller than their cameras say: sdd, sad, a pixel pitch or the CT's
// spacing may be wrong in all of them alike, which no view's correction against the others shows.

/// What one more parameter adds to a channel's JacobianSums: its derivative image S against the others.
struct ColumnSums {
    double sum = 0, fixed = 0, moving = 0, squared = 0;  ///< of w S, w A S, w B S, w S S
    std::array<double, 6> jacobian{};                    ///< of w S J_i

    ColumnSums& operator+=(const ColumnSums& other);
};

/// The derivative of a view's DRR by a parameter beside the pose.
using SeventhDerivative = std::function<Image(const Image& drr, std::size_t view)>;

/// As Linearization, with one more parameter: the logarithm of a view's magnification, or its response (response.h).
struct ScaledLinearization {
    Eigen::Matrix<double, 7, 1> gradient = Eigen::Matrix<double, 7, 1>::Zero();
    Eigen::Matrix<double, 7, 7> curvature = Eigen::Matrix<double, 7, 7>::Zero();
};

/// d I / d ln(m) of a DRR that is magnified by m about the camera's principal point c, as a longer sdd does:
/// I_m(u) = I(c + (u - c) / m), so -(u - c) . grad I at m = 1; central differences, zero in the outermost pixels.
[[nodiscard]] Image magnification_derivative(const Image& drr, const Camera& camera);
/// The same as pose_sums takes it. Borrows the views.
[[nodiscard]] SeventhDerivative by_magnification(std::span<const View> views);

/// Mean over channels, as linearize_view.
[[nodiscard]] ScaledLinearization linearize_scaled(std::span<const JacobianSums> channels,
                                                   std::span<const ColumnSums> columns);

/// By how much all views fit best magnified, the pose following: one Gauss-Newton step in both, and its delete-a-group
/// jackknife (confidence.h) with k = `calibration`. None for a single view, which cannot tell it from depth, and where
/// the sums were made without it.
[[nodiscard]] std::optional<Magnification> magnification(std::span<const ViewSums> views,
                                                         std::span<const double> shares, double calibration);

/// A reason to doubt the pose, where the magnification is known and farther from 1 than right cameras have shown.
[[nodiscard]] std::optional<std::string> magnification_doubt(const std::optional<Magnification>& magnification);

}  // namespace raylign::detail

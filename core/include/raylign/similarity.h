#pragma once

#include <Eigen/Core>
#include <string_view>

namespace raylign {

/// Width of the derivative-of-Gaussian filter. [Ino06] uses sigma = 3 px, R = 9 px (19 taps).
struct GradientFilter {
    double sigma_px = 3;  ///< in (0, 32]
    int radius_px = 9;    ///< taps reach from -R to R; in [1, 64]
};

/// What is compared of X-ray and DRR; the cost is 1 minus the correlation.
enum class Metric {
    gc,   ///< gradient correlation: mean NCC of the two gradient images, [Ino06] eq. 1-2, [Penney98]
    ncc,  ///< normalized cross correlation of the images themselves; biased by scatter and other content
};
[[nodiscard]] std::string_view metric_name(Metric metric);
[[nodiscard]] Metric metric_from_name(std::string_view name);

/// The cost.
struct Similarity {
    Metric metric = Metric::gc;
    GradientFilter filter;  ///< used by gc
};

/// Cost of a pose, its gradient and its Gauss-Newton matrix with respect to the twist (rad, mm).
struct Linearization {
    double cost = 0;
    Eigen::Matrix<double, 6, 1> gradient = Eigen::Matrix<double, 6, 1>::Zero();
    Eigen::Matrix<double, 6, 6> curvature = Eigen::Matrix<double, 6, 6>::Zero();  ///< symmetric, positive semidefinite

    Linearization& operator+=(const Linearization& other);
};

}  // namespace raylign

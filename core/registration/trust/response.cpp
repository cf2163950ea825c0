#include "core/registration/trust/response.h"

#include <cmath>

#include "core/base/linear_algebra.h"

namespace raylign::detail {

Image floor_derivative(Image shown, double floor) {
    for (float& pixel : shown.pixels) {
        const double arrives = std::exp(-static_cast<double>(pixel));
        pixel = static_cast<float>((arrives - 1) / ((1 - floor) * arrives));
    }
    return shown;
}

double floor_step(const ViewSums& sums) {
    const ScaledLinearization& at = sums.scaled.front();
    return -solve_symmetric(Eigen::MatrixXd(at.curvature), Eigen::VectorXd(at.gradient))[6];
}

}  // namespace raylign::detail

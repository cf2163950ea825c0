#include "core/registration/trust/response.h"

#include <algorithm>
#include <cmath>

#include "core/base/linear_algebra.h"

namespace raylign::detail {
namespace {

constexpr double kLeastArriving = 1e-6;  // less (metal that nothing gets through) would be more than a float holds

}  // namespace

Image floor_derivative(Image shown, double floor) {
    for (float& pixel : shown.pixels) {
        const double arrives = std::max(kLeastArriving, std::exp(-static_cast<double>(pixel)));
        pixel = static_cast<float>((arrives - 1) / ((1 - floor) * arrives));
    }
    return shown;
}

double floor_step(const ViewSums& sums) {
    const ScaledLinearization& at = sums.scaled.front();
    return -solve_symmetric(Eigen::MatrixXd(at.curvature), Eigen::VectorXd(at.gradient))[6];
}

}  // namespace raylign::detail

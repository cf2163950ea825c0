#include "core/registration/trust/response.h"

#include "core/base/linear_algebra.h"

namespace raylign::detail {
namespace {

/// The last entry of the step in pose and h.
double compression(const ScaledLinearization& at) {
    return -solve_symmetric(Eigen::MatrixXd(at.curvature), Eigen::VectorXd(at.gradient))[6];
}

/// How far a pose moves that ignores h, by h.
Twist pose_by_compression(const ScaledLinearization& at) {
    const Matrix6 curvature = at.curvature.topLeftCorner<6, 6>();
    return solve_symmetric(curvature, Twist(at.curvature.topRightCorner<6, 1>()));
}

}  // namespace

Image response_derivative(const Image& drr, std::size_t) {
    Image derivative = drr;
    for (float& pixel : derivative.pixels) pixel *= -pixel;
    return derivative;
}

ModelShift response_shift(const ViewSums& finest) {
    return {"response", 1, compression(finest.scaled.front()) * pose_by_compression(finest.scaled.front())};
}

}  // namespace raylign::detail

#include "core/similarity/linearization.h"

#include <cmath>

namespace raylign {
using namespace detail;
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

Vector6d vector6(const std::array<double, 6>& values) { return Eigen::Map<const Vector6d>(values.data()); }

Matrix6d symmetric(const std::array<double, 21>& upper) {
    Matrix6d matrix;
    for (int i = 0, k = 0; i < 6; ++i) {
        for (int j = i; j < 6; ++j, ++k) matrix(i, j) = matrix(j, i) = upper[k];
    }
    return matrix;
}

template <std::size_t n>
void add(std::array<double, n>& sum, const std::array<double, n>& other) {
    for (std::size_t i = 0; i < n; ++i) sum[i] += other[i];
}

}  // namespace

detail::JacobianSums& detail::JacobianSums::operator+=(const JacobianSums& other) {
    moments += other.moments;
    add(jacobian, other.jacobian);
    add(fixed_jacobian, other.fixed_jacobian);
    add(moving_jacobian, other.moving_jacobian);
    add(jacobian_jacobian, other.jacobian_jacobian);
    return *this;
}

Linearization& Linearization::operator+=(const Linearization& other) {
    cost += other.cost;
    gradient += other.gradient;
    curvature += other.curvature;
    return *this;
}

Linearization detail::linearize_channel(const JacobianSums& sums) {
    const MomentSums& m = sums.moments;
    const double correlation = normalized_cross_correlation(m);
    Linearization result{1 - correlation};
    if (moving_is_constant(m)) return result;
    const double fixed_norm = std::sqrt(m.fixed_fixed - m.fixed * m.fixed / m.weight);
    const double moving_norm = std::sqrt(m.moving_moving - m.moving * m.moving / m.weight);
    const Vector6d mean_jacobian = vector6(sums.jacobian) / m.weight;
    const Vector6d along_fixed = (vector6(sums.fixed_jacobian) - m.fixed * mean_jacobian) / fixed_norm;
    const Vector6d along_moving = (vector6(sums.moving_jacobian) - m.moving * mean_jacobian) / moving_norm;
    const Matrix6d centred = symmetric(sums.jacobian_jacobian) - m.weight * mean_jacobian * mean_jacobian.transpose();
    result.gradient = -(along_fixed - correlation * along_moving) / moving_norm;
    result.curvature = (centred - along_moving * along_moving.transpose()) / (moving_norm * moving_norm);
    return result;
}

Linearization detail::linearize_view(std::span<const JacobianSums> channels) {
    Linearization mean;
    for (const JacobianSums& channel : channels) mean += linearize_channel(channel);
    const auto count = static_cast<double>(channels.size());
    return {mean.cost / count, mean.gradient / count, mean.curvature / count};
}

JacobianSums detail::jacobian_sums(const Image& fixed, const Image& moving, std::span<const Image, 6> jacobian,
                                   const Image& weights) {
    JacobianSums sums;
    sums.moments = moment_sums(fixed, moving, weights);
    for (std::size_t p = 0; p < fixed.pixels.size(); ++p) {
        const double w = weights.pixels[p], a = fixed.pixels[p], b = moving.pixels[p];
        if (w == 0) continue;
        for (int i = 0, k = 0; i < 6; ++i) {
            const double weighted = w * jacobian[i].pixels[p];
            sums.jacobian[i] += weighted;
            sums.fixed_jacobian[i] += a * weighted;
            sums.moving_jacobian[i] += b * weighted;
            for (int j = i; j < 6; ++j, ++k) sums.jacobian_jacobian[k] += weighted * jacobian[j].pixels[p];
        }
    }
    return sums;
}

}  // namespace raylign

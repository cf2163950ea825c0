#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/base/linear_algebra.h"
#include "core/base/random.h"

namespace raylign::detail {
namespace {

constexpr double kRounding = 1e-11;  // of unit numbers, conditions of some hundred

Eigen::Matrix3d random_matrix(std::uint64_t seed) {
    Random random(seed);
    Eigen::Matrix3d matrix;
    for (double& value : matrix.reshaped()) value = random.uniform(-1, 1);
    return matrix;
}

/// A A^T + I: symmetric and positive, of condition below 30.
Eigen::MatrixXd random_positive(int n, std::uint64_t seed) {
    Random random(seed);
    Eigen::MatrixXd a(n, n);
    for (double& value : a.reshaped()) value = random.uniform(-1, 1);
    return a * a.transpose() + Eigen::MatrixXd::Identity(n, n);
}

void expect_orthogonal(const Eigen::Matrix3d& q) {
    EXPECT_LT((q * q.transpose() - Eigen::Matrix3d::Identity()).norm(), kRounding);
}

TEST(LinearAlgebra, DeterminantOfATriangleIsTheProductOfItsDiagonal) {
    Eigen::Matrix3d triangle;
    triangle << 2, 5, -7, 0, -3, 11, 0, 0, 4;
    EXPECT_DOUBLE_EQ(determinant_of(triangle), -24);
}

TEST(LinearAlgebra, DeterminantOfAProductIsTheProduct) {
    const Eigen::Matrix3d a = random_matrix(1), b = random_matrix(2);
    EXPECT_NEAR(determinant_of(a * b), determinant_of(a) * determinant_of(b), kRounding);
}

TEST(LinearAlgebra, InverseTimesMatrixIsOne) {
    const Eigen::Matrix3d a = random_matrix(3);
    ASSERT_GT(std::abs(determinant_of(a)), 0.01);
    EXPECT_LT((inverse_of(a) * a - Eigen::Matrix3d::Identity()).norm(), kRounding);
}

TEST(LinearAlgebra, SolvesSymmetricSystemsOfThreeSixAndAny) {
    const Eigen::Matrix3d three = random_positive(3, 4);
    const Eigen::Vector3d x3(1, -2, 3);
    EXPECT_LT((solve_symmetric(three, Eigen::Vector3d(three * x3)) - x3).norm(), kRounding);
    const Matrix6 six = random_positive(6, 5);
    const Vector6 x6 = Vector6::LinSpaced(-1, 4);
    EXPECT_LT((solve_symmetric(six, Vector6(six * x6)) - x6).norm(), kRounding);
    const Eigen::MatrixXd nine = random_positive(9, 6);
    const Eigen::VectorXd x9 = Eigen::VectorXd::LinSpaced(9, 2, -2);
    EXPECT_LT((solve_symmetric(nine, Eigen::VectorXd(nine * x9)) - x9).norm(), kRounding);
}

TEST(LinearAlgebra, SolvesASingularSystemThatHasASolution) {
    const Eigen::Vector3d direction(1, 2, -1);
    const Eigen::Matrix3d rank_one = direction * direction.transpose();
    const Eigen::Vector3d x = solve_symmetric(rank_one, Eigen::Vector3d(3 * direction));
    EXPECT_NEAR(direction.dot(x), 3, kRounding);
    EXPECT_TRUE(x.allFinite());
}

TEST(LinearAlgebra, SolvesGeneralSystems) {
    Eigen::Matrix3d swapped;  // needs a pivot
    swapped << 0, 2, 1, 3, 0, -1, 1, 1, 1;
    const Eigen::Vector3d x(0.5, -4, 2);
    EXPECT_LT((solve_general(swapped, swapped * x) - x).norm(), kRounding);
}

TEST(LinearAlgebra, PrincipalAxesOfADiagonalAreItsSortedEntries) {
    const PrincipalAxes axes = principal_axes(Eigen::Vector3d(5, -1, 2).asDiagonal());
    EXPECT_LT((axes.values - Eigen::Vector3d(-1, 2, 5)).norm(), kRounding);
    EXPECT_NEAR(std::abs(axes.axes(1, 0)), 1, kRounding);
    EXPECT_NEAR(std::abs(axes.axes(2, 1)), 1, kRounding);
    EXPECT_NEAR(std::abs(axes.axes(0, 2)), 1, kRounding);
}

TEST(LinearAlgebra, PrincipalAxesGiveTheMatrixBack) {
    const Eigen::Matrix3d matrix = random_positive(3, 7);
    const PrincipalAxes axes = principal_axes(matrix);
    expect_orthogonal(axes.axes);
    EXPECT_LE(axes.values[0], axes.values[1]);
    EXPECT_LE(axes.values[1], axes.values[2]);
    EXPECT_LT((axes.axes * axes.values.asDiagonal() * axes.axes.transpose() - matrix).norm(), kRounding);
}

TEST(LinearAlgebra, RqFactorsAreATriangleWithPositiveDiagonalTimesARotationOrMirror) {
    for (std::uint64_t seed = 10; seed < 20; ++seed) {
        const Eigen::Matrix3d matrix = random_matrix(seed);
        const RqFactors f = rq_factors(matrix);
        EXPECT_LT((f.r * f.q - matrix).norm(), kRounding) << seed;
        expect_orthogonal(f.q);
        EXPECT_GT(f.r.diagonal().minCoeff(), 0) << seed;
        EXPECT_LT(std::max({std::abs(f.r(1, 0)), std::abs(f.r(2, 0)), std::abs(f.r(2, 1))}), kRounding) << seed;
    }
}

TEST(LinearAlgebra, RqFactorsOfCameraTimesRotationAreTheTwo) {
    Eigen::Matrix3d camera, rotation;
    camera << 1500, 0.5, 320, 0, 1490, 240, 0, 0, 1;
    rotation << 0.36, 0.48, -0.8, -0.8, 0.6, 0, 0.48, 0.64, 0.6;
    const RqFactors f = rq_factors(camera * rotation);
    EXPECT_LT((f.r - camera).norm(), 1e-9);
    EXPECT_LT((f.q - rotation).norm(), kRounding);
}

TEST(LinearAlgebra, SingularVectorsMakeTheMatrixDiagonalPositiveAndFalling) {
    const Eigen::Matrix3d matrix = random_matrix(8);
    const SingularVectors s = singular_vectors(matrix);
    expect_orthogonal(s.u);
    expect_orthogonal(s.v);
    const Eigen::Matrix3d diagonal = s.u.transpose() * matrix * s.v;
    const Eigen::Vector3d values = diagonal.diagonal();
    EXPECT_LT((diagonal - Eigen::Matrix3d(values.asDiagonal())).norm(), kRounding);
    EXPECT_GE(values[0], values[1]);
    EXPECT_GE(values[1], values[2]);
    EXPECT_GE(values[2], 0);
}

}  // namespace
}  // namespace raylign::detail

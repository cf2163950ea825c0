#pragma once

#include <Eigen/Core>

namespace raylign::detail {

// Eigen's decompositions, each compiled once: every unit that instantiates one of its own takes seconds longer.

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

[[nodiscard]] double determinant_of(const Eigen::Matrix3d& matrix);
[[nodiscard]] Eigen::Matrix3d inverse_of(const Eigen::Matrix3d& matrix);

/// x with matrix x = right by L D L^T: `matrix` symmetric and semidefinite.
[[nodiscard]] Eigen::Vector3d solve_symmetric(const Eigen::Matrix3d& matrix, const Eigen::Vector3d& right);
[[nodiscard]] Vector6 solve_symmetric(const Matrix6& matrix, const Vector6& right);
[[nodiscard]] Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right);

/// x with matrix x = right by LU with partial pivoting.
[[nodiscard]] Eigen::Vector3d solve_general(const Eigen::Matrix3d& matrix, const Eigen::Vector3d& right);

/// Eigenvalues of a symmetric matrix, rising, and its unit eigenvectors in their order.
struct PrincipalAxes {
    Eigen::Vector3d values;
    Eigen::Matrix3d axes;
};
[[nodiscard]] PrincipalAxes principal_axes(const Eigen::Matrix3d& symmetric);

/// Upper triangular r with positive diagonal and orthogonal q such that matrix = r q.
struct RqFactors {
    Eigen::Matrix3d r, q;
};
[[nodiscard]] RqFactors rq_factors(const Eigen::Matrix3d& matrix);

/// Of the singular value decomposition, matrix = u diag(values) v^T.
struct SingularVectors {
    Eigen::Matrix3d u, v;
};
[[nodiscard]] SingularVectors singular_vectors(const Eigen::Matrix3d& matrix);

}  // namespace raylign::detail

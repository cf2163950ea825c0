#include "core/base/linear_algebra.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace raylign::detail {

double determinant_of(const Eigen::Matrix3d& matrix) { return matrix.determinant(); }
Eigen::Matrix3d inverse_of(const Eigen::Matrix3d& matrix) { return matrix.inverse(); }

Eigen::Vector3d solve_symmetric(const Eigen::Matrix3d& matrix, const Eigen::Vector3d& right) {
    return matrix.ldlt().solve(right);
}
Vector6 solve_symmetric(const Matrix6& matrix, const Vector6& right) { return matrix.ldlt().solve(right); }
Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right) {
    return matrix.ldlt().solve(right);
}

Eigen::Vector3d solve_general(const Eigen::Matrix3d& matrix, const Eigen::Vector3d& right) {
    return matrix.partialPivLu().solve(right);
}

PrincipalAxes principal_axes(const Eigen::Matrix3d& symmetric) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(symmetric);
    return {solver.eigenvalues(), solver.eigenvectors()};
}

RqFactors rq_factors(const Eigen::Matrix3d& matrix) {
    // RQ is QR of the row-reversed transpose, reversed back.
    Eigen::Matrix3d reversal = Eigen::Matrix3d::Zero();
    reversal(0, 2) = reversal(1, 1) = reversal(2, 0) = 1;
    const Eigen::HouseholderQR<Eigen::Matrix3d> qr((reversal * matrix).transpose());
    const Eigen::Matrix3d upper = qr.matrixQR().triangularView<Eigen::Upper>();
    Eigen::Matrix3d r = reversal * upper.transpose() * reversal;
    Eigen::Matrix3d q = reversal * Eigen::Matrix3d(qr.householderQ()).transpose();
    for (int i = 0; i < 3; ++i) {
        if (r(i, i) < 0) {
            r.col(i) = -r.col(i);
            q.row(i) = -q.row(i);
        }
    }
    return {r, q};
}

SingularVectors singular_vectors(const Eigen::Matrix3d& matrix) {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
    return {svd.matrixU(), svd.matrixV()};
}

}  // namespace raylign::detail

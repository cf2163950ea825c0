#include "raylign/rigid_transform.h"

#include <Eigen/Geometry>
#include <cmath>
#include <sstream>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"

namespace raylign {
using namespace detail;
namespace {

constexpr double kOrthonormalTolerance = 1e-4;  // text files often carry five or six digits

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& w) {
    Eigen::Matrix3d m;
    m << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
    return m;
}

/// sin t / t, (1 - cos t) / t^2 and (t - sin t) / t^3, by series where the closed forms cancel.
struct ExpFactors {
    double a, b, c;
};

ExpFactors exp_factors(double angle) {
    const double t2 = angle * angle;
    if (angle < 1e-2) {  // truncation below t^6 / 5040 ~ 2e-16
        return {1 - t2 / 6 * (1 - t2 / 20), 0.5 - t2 / 24 * (1 - t2 / 30), 1.0 / 6 - t2 / 120 * (1 - t2 / 42)};
    }
    return {std::sin(angle) / angle, (1 - std::cos(angle)) / t2, (angle - std::sin(angle)) / (t2 * angle)};
}

Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& w) {
    const ExpFactors f = exp_factors(w.norm());
    const Eigen::Matrix3d k = cross_matrix(w);
    return Eigen::Matrix3d::Identity() + f.b * k + f.c * k * k;
}

std::string print(const Eigen::Matrix3d& m) {
    std::ostringstream text;
    text << m.format(Eigen::IOFormat(6, Eigen::DontAlignCols, ", ", "; ", "", "", "[", "]"));
    return text.str();
}

}  // namespace

RigidTransform operator*(const RigidTransform& c_from_b, const RigidTransform& b_from_a) {
    return {c_from_b.rotation * b_from_a.rotation,
            c_from_b.rotation * b_from_a.translation_mm + c_from_b.translation_mm};
}

Eigen::Vector3d operator*(const RigidTransform& b_from_a, const Eigen::Vector3d& x_a) {
    return b_from_a.rotation * x_a + b_from_a.translation_mm;
}

RigidTransform inverse(const RigidTransform& b_from_a) {
    const Eigen::Matrix3d rotation = b_from_a.rotation.transpose();
    return {rotation, -(rotation * b_from_a.translation_mm)};
}

RigidTransform exp(const Twist& twist) {
    const Eigen::Vector3d w = twist.head<3>();
    const ExpFactors f = exp_factors(w.norm());
    const Eigen::Matrix3d k = cross_matrix(w);
    const Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity() + f.a * k + f.b * k * k;
    return {rotation, left_jacobian(w) * twist.tail<3>()};
}

Twist log(const RigidTransform& b_from_a) {
    // The quaternion form is accurate over the whole range, pi included (the trace form is not).
    Eigen::Quaterniond q(b_from_a.rotation);
    if (q.w() < 0) q.coeffs() = -q.coeffs();
    const double sine = q.vec().norm();
    const double angle = 2 * std::atan2(sine, q.w());
    const Eigen::Vector3d w = sine < 1e-12 ? Eigen::Vector3d(2 * q.vec()) : Eigen::Vector3d(angle / sine * q.vec());
    Twist twist;
    twist << w, solve_general(left_jacobian(w), b_from_a.translation_mm);
    return twist;
}

RigidTransform exp_about(const Twist& twist, const Eigen::Vector3d& centre_mm) {
    return RigidTransform::translate(centre_mm) * exp(twist) * RigidTransform::translate(-centre_mm);
}

double rotation_angle_rad(const RigidTransform& b_from_a) {
    const Eigen::Quaterniond q(b_from_a.rotation);
    return 2 * std::atan2(q.vec().norm(), std::abs(q.w()));
}

bool is_finite(const RigidTransform& b_from_a) {
    return b_from_a.rotation.allFinite() && b_from_a.translation_mm.allFinite();
}

Eigen::Matrix4d to_matrix(const RigidTransform& b_from_a) {
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    matrix.topLeftCorner<3, 3>() = b_from_a.rotation;
    matrix.topRightCorner<3, 1>() = b_from_a.translation_mm;
    return matrix;
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix) {
    const auto [u, v] = singular_vectors(matrix);
    const Eigen::Vector3d signs(1, 1, determinant_of(u * v.transpose()) < 0 ? -1 : 1);
    return u * signs.asDiagonal() * v.transpose();
}

RigidTransform rigid_from_matrix(const Eigen::Matrix4d& matrix, std::string_view where) {
    if (!matrix.allFinite()) throw Error("transform in " + std::string(where) + ": must have finite numbers only");
    if ((matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-9) {
        throw Error("last row of the transform in " + std::string(where) + ": must be 0 0 0 1");
    }
    const Eigen::Matrix3d linear = matrix.topLeftCorner<3, 3>();
    const double departure = (linear * linear.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    if (departure > kOrthonormalTolerance) {
        throw bad_value("rotation", print(linear), "orthonormal within 1e-4 (scale or shear found)", where);
    }
    if (determinant_of(linear) < 0) {
        throw bad_value("rotation", print(linear), "a proper rotation, determinant +1 (it mirrors)", where);
    }
    return {nearest_rotation(linear), matrix.topRightCorner<3, 1>()};
}

}  // namespace raylign

#pragma once

#include <Eigen/Core>
#include <string_view>

namespace raylign {

/// Rotation vector [rad] and translation [mm], in this order: the tangent space of rigid transforms.
using Twist = Eigen::Matrix<double, 6, 1>;

/// A rigid transform named `b_from_a` maps coordinates: x_b = rotation * x_a + translation_mm.
/// Products read c_from_b * b_from_a. The rotation is orthonormal with determinant +1.
struct RigidTransform {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();

    [[nodiscard]] static RigidTransform translate(const Eigen::Vector3d& offset_mm) {
        return {Eigen::Matrix3d::Identity(), offset_mm};
    }
};

[[nodiscard]] RigidTransform operator*(const RigidTransform& c_from_b, const RigidTransform& b_from_a);
[[nodiscard]] Eigen::Vector3d operator*(const RigidTransform& b_from_a, const Eigen::Vector3d& x_a);

[[nodiscard]] RigidTransform inverse(const RigidTransform& b_from_a);

/// Exponential of SE(3): exp(w, v) = (R, V v), R = I + A [w] + B [w]^2, V = I + B [w] + C [w]^2 with, for t = |w|,
/// A = sin t / t, B = (1 - cos t) / t^2, C = (t - sin t) / t^3. Source: Barfoot, State Estimation for Robotics,
/// eq. 7.86.
[[nodiscard]] RigidTransform exp(const Twist& twist);

/// Inverse of exp for rotation angles in [0, pi]; at pi one of the two equal axes is chosen.
[[nodiscard]] Twist log(const RigidTransform& b_from_a);

/// T(c) exp(twist) T(-c): the twist applied about the point `centre_mm` instead of the origin.
[[nodiscard]] RigidTransform exp_about(const Twist& twist, const Eigen::Vector3d& centre_mm);

/// Rotation angle in [0, pi], radians.
[[nodiscard]] double rotation_angle_rad(const RigidTransform& b_from_a);

[[nodiscard]] bool is_finite(const RigidTransform& b_from_a);

[[nodiscard]] Eigen::Matrix4d to_matrix(const RigidTransform& b_from_a);

/// A homogeneous 4x4 matrix as a rigid transform. `where` names the source of the matrix in error messages.
/// The rotation must be orthonormal within 1e-4 (text files carry few digits) and is then made exactly so (nearest
/// rotation). Throws Error for non-finite numbers, a last row other than 0 0 0 1, a non-orthonormal or mirrored
/// rotation.
[[nodiscard]] RigidTransform rigid_from_matrix(const Eigen::Matrix4d& matrix, std::string_view where);

/// Nearest rotation matrix in the Frobenius norm (polar decomposition by SVD).
[[nodiscard]] Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix);

}  // namespace raylign

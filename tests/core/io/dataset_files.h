#pragma once

#include <Eigen/Core>

namespace raylign::detail::test {

inline Eigen::Matrix4d rigid(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation) {
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    matrix.topLeftCorner<3, 3>() = rotation;
    matrix.topRightCorner<3, 1>() = translation;
    return matrix;
}

/// (x, y, z) to (-y, x, z).
inline Eigen::Matrix3d quarter_turn_about_z() {
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
    matrix(0, 1) = -1;
    matrix(1, 0) = matrix(2, 2) = 1;
    return matrix;
}

/// A point of the volumes in the data sets' small files.
inline const Eigen::Vector3d kLandmark(13, 24, 5);

}  // namespace raylign::detail::test

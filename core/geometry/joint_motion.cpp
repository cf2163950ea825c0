#include "raylign/joint_motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/error.h"

namespace raylign {
using namespace detail;
namespace {

constexpr double kGimbal_rad = 1e-7;     // beyond, rounding decides what a and c are
constexpr double kLeastTurn_rad = 1e-6;  // a turn of this much shifts the rim of a bone by less than 0.1 um

/// 1 for xyz, yzx and zxy, else -1.
double parity(const CardanSequence& sequence) { return (sequence.axes[1] - sequence.axes[0] + 3) % 3 == 1 ? 1 : -1; }

}  // namespace

std::string CardanSequence::name() const {
    std::string text;
    for (const int axis : axes) text += "XYZ"[axis];
    return text;
}

CardanSequence CardanSequence::from_name(std::string_view name) {
    for (const std::string_view known : {"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"}) {
        if (name == known) return {{known[0] - 'X', known[1] - 'X', known[2] - 'X'}};
    }
    throw bad_value("Cardan sequence", name, "XYZ, XZY, YXZ, YZX, ZXY or ZYX");
}

Eigen::Vector3d cardan_angles_rad(const Eigen::Matrix3d& proximal_from_distal, const CardanSequence& sequence) {
    const Eigen::Matrix3d& r = proximal_from_distal;
    const auto [i, j, k] = sequence.axes;
    const double e = parity(sequence);
    const double b = std::asin(std::clamp(e * r(i, k), -1.0, 1.0));
    if (std::hypot(r(i, i), r(i, j)) < kGimbal_rad) return {std::atan2(e * r(k, j), r(j, j)), b, 0};
    return {std::atan2(-e * r(j, k), r(k, k)), b, std::atan2(-e * r(i, j), r(i, i))};
}

Eigen::Matrix3d rotation_from_cardan(const Eigen::Vector3d& angles_rad, const CardanSequence& sequence) {
    Eigen::Matrix3d product = Eigen::Matrix3d::Identity();
    for (int turn = 0; turn < 3; ++turn) {
        product *= Eigen::AngleAxisd(angles_rad[turn], Eigen::Vector3d::Unit(sequence.axes[turn])).toRotationMatrix();
    }
    return product;
}

HelicalAxis helical_axis(const RigidTransform& motion) {
    HelicalAxis axis;
    const Eigen::Vector3d turn_rad = log(motion).head<3>();
    axis.angle_rad = turn_rad.norm();
    const Eigen::Vector3d& t = motion.translation_mm;
    if (axis.angle_rad < kLeastTurn_rad) {
        axis.angle_rad = 0;
        axis.shift_mm = t.norm();
        if (axis.shift_mm > 0) axis.direction = t / axis.shift_mm;
        return axis;
    }
    axis.direction = turn_rad / axis.angle_rad;
    axis.shift_mm = axis.direction.dot(t);
    const Eigen::Vector3d across = t - axis.shift_mm * axis.direction;
    axis.point_mm = (across + axis.direction.cross(across) / std::tan(axis.angle_rad / 2)) / 2;
    return axis;
}

}  // namespace raylign

#include "core/registration/scene/joints.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "core/base/error.h"
#include "core/base/number_text.h"

namespace raylign::detail {
namespace {

constexpr double kSigmasOfLimit = 2.795;  // 95 % of three unit normal components lie within: sqrt of chi-square's 7.81
constexpr double kNearest_share = 0.1;    // of the smaller object's points are where two objects are nearest
constexpr double kMostApart_mm = 100;     // between neighbours' nearest points, of samples a twelfth of them apart
constexpr double kSmallTurn_rad = 1e-4;

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d cross(const Vector3d& v) {
    Matrix3d m;
    m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return m;
}

/// By how much the rotation vector changes per small turn from the left: the inverse left Jacobian of SO(3) (Barfoot,
/// State Estimation for Robotics, eq. 7.76b).
Matrix3d vector_from_turn(const Vector3d& rotation_rad) {
    const double angle = rotation_rad.norm();
    const double factor = angle < kSmallTurn_rad ? 1.0 / 12 : (1 - angle / 2 / std::tan(angle / 2)) / (angle * angle);
    const Matrix3d across = cross(rotation_rad);
    return Matrix3d::Identity() - across / 2 + factor * across * across;
}

/// Of each point of `from` the nearest of `to`.
struct Pair {
    double apart_mm;
    Vector3d middle_mm;
};

std::vector<Pair> nearest_pairs(const ObjectSample& from, const ObjectSample& to) {
    std::vector<Pair> pairs;
    for (const Vector3d& a : from.points_ct_mm) {
        Pair nearest{std::numeric_limits<double>::infinity(), a};
        for (const Vector3d& b : to.points_ct_mm) {
            const double apart = (a - b).norm();
            if (apart < nearest.apart_mm) nearest = {apart, (a + b) / 2};
        }
        pairs.push_back(nearest);
    }
    std::ranges::stable_sort(pairs, {}, &Pair::apart_mm);
    return pairs;
}

}  // namespace

JointPrior make_joint_prior(const JointLimit& limit, const ObjectSample& first, const ObjectSample& second,
                            std::span<const std::string> names) {
    const bool first_is_smaller = first.points_ct_mm.size() <= second.points_ct_mm.size();
    const std::vector<Pair> pairs = first_is_smaller ? nearest_pairs(first, second) : nearest_pairs(second, first);
    if (pairs.front().apart_mm > kMostApart_mm) {
        throw Error("joint of " + names[limit.first] + " and " + names[limit.second] + ": they lie " +
                    fixed(pairs.front().apart_mm, 0) +
                    " mm apart in the CT; a joint holds neighbours (files of bones must share the CT's coordinates)");
    }
    const auto count = std::max<std::size_t>(1, static_cast<std::size_t>(kNearest_share * pairs.size()));
    JointPrior joint{limit};
    for (std::size_t i = 0; i < count; ++i) joint.centre_ct_mm += pairs[i].middle_mm / static_cast<double>(count);
    joint.sigma_mm = limit.apart_mm / kSigmasOfLimit;
    joint.sigma_rad = limit.turned_deg * std::numbers::pi / 180 / kSigmasOfLimit;
    return joint;
}

JointMotion joint_motion(const JointPrior& joint, const RigidTransform& first_world_from_ct,
                         const RigidTransform& second_world_from_ct) {
    const RigidTransform turn{second_world_from_ct.rotation * first_world_from_ct.rotation.transpose(),
                              Vector3d::Zero()};
    return {log(turn).head<3>(), second_world_from_ct * joint.centre_ct_mm - first_world_from_ct * joint.centre_ct_mm};
}

JointResidual joint_residual(const JointPrior& joint, const RigidTransform& first_world_from_ct,
                             const RigidTransform& second_world_from_ct, const Vector3d& first_centre_mm,
                             const Vector3d& second_centre_mm) {
    const JointMotion motion = joint_motion(joint, first_world_from_ct, second_world_from_ct);
    JointResidual at;
    at.residual << motion.turn_rad / joint.sigma_rad, motion.shift_mm / joint.sigma_mm;
    at.by_first.setZero();
    at.by_second.setZero();
    // A turn of the first from the left is one of the relative rotation from the right, the other way round.
    at.by_first.topLeftCorner<3, 3>() = -vector_from_turn(-motion.turn_rad) / joint.sigma_rad;
    at.by_second.topLeftCorner<3, 3>() = vector_from_turn(motion.turn_rad) / joint.sigma_rad;
    at.by_first.bottomLeftCorner<3, 3>() =
        cross(first_world_from_ct * joint.centre_ct_mm - first_centre_mm) / joint.sigma_mm;
    at.by_second.bottomLeftCorner<3, 3>() =
        -cross(second_world_from_ct * joint.centre_ct_mm - second_centre_mm) / joint.sigma_mm;
    at.by_first.bottomRightCorner<3, 3>() = -Matrix3d::Identity() / joint.sigma_mm;
    at.by_second.bottomRightCorner<3, 3>() = Matrix3d::Identity() / joint.sigma_mm;
    return at;
}

double joint_cost(std::span<const JointPrior> joints, std::span<const RigidTransform> world_from_ct) {
    double cost = 0;
    for (const JointPrior& joint : joints) {
        const JointMotion motion =
            joint_motion(joint, world_from_ct[joint.limit.first], world_from_ct[joint.limit.second]);
        cost +=
            ((motion.turn_rad / joint.sigma_rad).squaredNorm() + (motion.shift_mm / joint.sigma_mm).squaredNorm()) / 2;
    }
    return cost;
}

void add_joints(std::span<const JointPrior> joints, std::span<const RigidTransform> world_from_ct,
                std::span<const JointEnd> ends, double noise, LocalModel& model) {
    const auto per_parameter = [](const JointEnd& end) {
        Twist scale = Twist::Ones();
        scale.head<3>() /= end.radius_mm;
        return scale;
    };
    for (const JointPrior& joint : joints) {
        const JointEnd& first = ends[joint.limit.first];
        const JointEnd& second = ends[joint.limit.second];
        const JointResidual at =
            joint_residual(joint, world_from_ct[joint.limit.first], world_from_ct[joint.limit.second],
                           first.centre_world_mm, second.centre_world_mm);
        Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(6, model.gradient.size());
        if (first.at >= 0) jacobian.middleCols<6>(first.at) = at.by_first * per_parameter(first).asDiagonal();
        if (second.at >= 0) jacobian.middleCols<6>(second.at) = at.by_second * per_parameter(second).asDiagonal();
        model.cost += noise * at.residual.squaredNorm() / 2;
        model.gradient += noise * jacobian.transpose() * at.residual;
        model.curvature += noise * jacobian.transpose() * jacobian;
    }
}

}  // namespace raylign::detail

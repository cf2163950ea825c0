// Limits of joints: their residuals against differences, what they refuse, and what they bring into a scene.

#include "core/registration/scene/joints.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/registration/object/pose_space.h"
#include "tests/support/errors.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

constexpr double kStep = 1e-5;        // rad and mm
constexpr double kDerivative = 1e-6;  // of values of order 1 to 100
const std::array<std::string, 2> kNames{"first", "second"};

ObjectSample cube_of_points(const Eigen::Vector3d& corner_mm) {
    ObjectSample sample;
    for (int i = 0; i < 27; ++i) {
        sample.points_ct_mm.push_back(corner_mm + 10 * Eigen::Vector3d(i % 3, i / 3 % 3, i / 9));
        sample.weights.push_back(1.0 / 27);
    }
    return sample;
}

JointPrior joint_between_cubes() {
    return make_joint_prior({0, 1, 3, 4}, cube_of_points({0, 0, 0}), cube_of_points({0, 0, 40}), kNames);
}

struct Moved {
    JointPrior joint = joint_between_cubes();
    std::vector<RigidTransform> poses{test::oblique_pose(), {}};
    std::vector<Eigen::Vector3d> centres;

    Moved() {
        Twist twist;
        twist << 0.2, -0.1, 0.15, 4, -3, 2;
        poses[1] = exp_about(twist, poses[0] * Eigen::Vector3d(10, 10, 50)) * poses[0];
        for (std::size_t k = 0; k < 2; ++k) centres.push_back(poses[k] * Eigen::Vector3d(10, 10, 10 + 40.0 * k));
    }
    [[nodiscard]] JointResidual at(std::size_t k, const Twist& twist) const {
        std::vector<RigidTransform> moved = poses;
        moved[k] = exp_about(twist, centres[k]) * moved[k];
        return joint_residual(joint, moved[0], moved[1], centres[0], centres[1]);
    }
};

}  // namespace

TEST(Joints, AreWhereTheObjectsAreNearest) {
    const JointPrior joint = joint_between_cubes();
    EXPECT_NEAR(joint.centre_ct_mm.z(), 30, 1e-9);  // between the upper points at 20 and the lower ones at 40
    EXPECT_NEAR(joint.sigma_mm, 3 / 2.795, 1e-12);
}

TEST(Joints, HoldNothingThatLiesFarApart) {
    EXPECT_THAT(
        test::error_of([] {
            (void)make_joint_prior({0, 1, 3, 4}, cube_of_points({0, 0, 0}), cube_of_points({0, 0, 400}), kNames);
        }),
        testing::HasSubstr("380 mm apart"));
}

TEST(Joints, ResidualIsZeroWhereTheCtHasThem) {
    const RigidTransform pose = test::oblique_pose();
    const JointResidual at = joint_residual(joint_between_cubes(), pose, pose, {}, {});
    EXPECT_LT(at.residual.norm(), 1e-9);
}

TEST(Joints, ResidualsDerivativesAreThoseOfDifferences) {
    const Moved moved;
    const JointResidual at = moved.at(0, Twist::Zero());
    for (std::size_t k = 0; k < 2; ++k) {
        const auto& derivative = k == 0 ? at.by_first : at.by_second;
        for (int i = 0; i < 6; ++i) {
            const Twist step = kStep * Twist::Unit(i);
            const Twist difference = (moved.at(k, step).residual - moved.at(k, -step).residual) / (2 * kStep);
            EXPECT_LT((difference - derivative.col(i)).norm(), kDerivative * (1 + derivative.col(i).norm()))
                << "object " << k << ", parameter " << i;
        }
    }
}

// Gradient and blocks of a model, cross blocks with them, in the parameters that the optimizer sees.
TEST(Joints, ModelIsThatOfTheirCost) {
    const Moved moved;
    constexpr double kNoise = 0.5;
    std::vector<JointEnd> ends;
    for (std::size_t k = 0; k < 2; ++k) ends.push_back({static_cast<Eigen::Index>(6 * k), moved.centres[k], 20});
    LocalModel model{0, Eigen::VectorXd::Zero(12), Eigen::MatrixXd::Zero(12, 12)};
    add_joints({&moved.joint, 1}, moved.poses, ends, kNoise, model);
    EXPECT_NEAR(model.cost, kNoise * joint_cost({&moved.joint, 1}, moved.poses), 1e-12);
    const auto cost_at = [&](Eigen::Index parameter, double step) {
        const std::size_t k = parameter < 6 ? 0 : 1;
        std::vector<RigidTransform> poses = moved.poses;
        const Eigen::VectorXd x = step * Eigen::VectorXd::Unit(6, parameter % 6);
        poses[k] = PoseSpace{poses[k], moved.centres[k], 20}.pose(x);
        return kNoise * joint_cost({&moved.joint, 1}, poses);
    };
    for (Eigen::Index i = 0; i < 12; ++i) {
        const double slope = (cost_at(i, kStep) - cost_at(i, -kStep)) / (2 * kStep);
        EXPECT_NEAR(model.gradient[i], slope, 1e-5 * (1 + std::abs(slope))) << "parameter " << i;
    }
    const JointResidual at = moved.at(0, Twist::Zero());
    const Eigen::Matrix3d across = kNoise * at.by_first.rightCols<3>().transpose() * at.by_second.rightCols<3>();
    EXPECT_LT((model.curvature.block<3, 3>(3, 9) - across).norm(), 1e-12 * across.norm());
    EXPECT_LT((model.curvature - model.curvature.transpose()).norm(), 1e-12 * model.curvature.norm());
}

TEST(Joints, AnObjectThatStaysHasNoBlock) {
    const Moved moved;
    const std::vector<JointEnd> ends{{-1, {}, 1}, {0, moved.centres[1], 20}};
    LocalModel model{0, Eigen::VectorXd::Zero(6), Eigen::MatrixXd::Zero(6, 6)};
    add_joints({&moved.joint, 1}, moved.poses, ends, 1, model);
    EXPECT_GT(model.gradient.norm(), 0);
}

}  // namespace raylign::detail

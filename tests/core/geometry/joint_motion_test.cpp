#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "core/base/error.h"
#include "raylign/joint_motion.h"
#include "tests/support/errors.h"

namespace raylign::detail {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
const std::vector<std::string> kNames{"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"};

TEST(Cardan, AnglesAreThoseOfTheProductOfThreeTurns) {
    for (const std::string& name : kNames) {
        const CardanSequence sequence = CardanSequence::from_name(name);
        EXPECT_EQ(sequence.name(), name);
        for (const Eigen::Vector3d& angles_deg :
             {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(95, -12, 7), Eigen::Vector3d(-150, 80, 179)}) {
            const Eigen::Vector3d found =
                cardan_angles_rad(rotation_from_cardan(angles_deg * kDegree, sequence), sequence);
            EXPECT_LT((found / kDegree - angles_deg).norm(), 1e-9) << name << ": " << found.transpose() / kDegree;
        }
    }
}

TEST(Cardan, ASingleTurnIsTheAngleOfItsAxis) {
    for (const std::string& name : kNames) {
        const CardanSequence sequence = CardanSequence::from_name(name);
        for (int turn = 0; turn < 3; ++turn) {
            const Eigen::Matrix3d rotation =
                Eigen::AngleAxisd(0.4, Eigen::Vector3d::Unit(sequence.axes[turn])).toRotationMatrix();
            EXPECT_LT((cardan_angles_rad(rotation, sequence) - 0.4 * Eigen::Vector3d::Unit(turn)).norm(), 1e-12);
        }
    }
}

TEST(Cardan, GimbalLockKeepsTheRotationAndNoThirdAngle) {
    for (const std::string& name : kNames) {
        const CardanSequence sequence = CardanSequence::from_name(name);
        for (const double middle : {90.0, -90.0}) {
            const Eigen::Matrix3d rotation = rotation_from_cardan(Eigen::Vector3d(30, middle, 20) * kDegree, sequence);
            const Eigen::Vector3d angles = cardan_angles_rad(rotation, sequence);
            EXPECT_EQ(angles[2], 0);
            EXPECT_LT((rotation_from_cardan(angles, sequence) - rotation).norm(), 1e-7) << name;
        }
    }
}

TEST(Cardan, UnknownSequencesAreRefusedWithTheKnownOnes) {
    for (const std::string name : {"ZXZ", "xyz", "", "XYZX"}) {
        const std::string message = test::error_of([&] { (void)CardanSequence::from_name(name); });
        EXPECT_NE(message.find("ZXY"), std::string::npos) << message;
    }
}

TEST(Helical, ATurnAboutALineIsFoundWithItsShift) {
    const Eigen::Vector3d direction = Eigen::Vector3d(1, -2, 0.5).normalized();
    Eigen::Vector3d point(4, 7, -3);
    point -= direction.dot(point) * direction;  // nearest to the origin
    for (const double angle : {1e-3, 0.7, 2.9}) {
        Twist turn = Twist::Zero();
        turn.head<3>() = angle * direction;
        const HelicalAxis found = helical_axis(RigidTransform::translate(2.5 * direction) * exp_about(turn, point));
        EXPECT_NEAR(found.angle_rad, angle, 1e-12);
        EXPECT_NEAR(found.shift_mm, 2.5, 1e-9);
        EXPECT_LT((found.direction - direction).norm(), 1e-9);
        EXPECT_LT((found.point_mm - point).norm(), 1e-6);
    }
}

TEST(Helical, AShiftHasNoTurnAndRestHasNeither) {
    const HelicalAxis shift = helical_axis(RigidTransform::translate({0, -3, 4}));
    EXPECT_EQ(shift.angle_rad, 0);
    EXPECT_EQ(shift.shift_mm, 5);
    EXPECT_LT((shift.direction - Eigen::Vector3d(0, -0.6, 0.8)).norm(), 1e-15);
    const HelicalAxis rest = helical_axis({});
    EXPECT_EQ(rest.shift_mm, 0);
    EXPECT_EQ(rest.direction.norm(), 0);
}

}  // namespace
}  // namespace raylign::detail

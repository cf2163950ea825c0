#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/base/error.h"
#include "core/base/random.h"
#include "raylign/rigid_transform.h"
#include "tests/support/errors.h"

namespace raylign::detail {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kExact = 1e-13;     // rotations: a few roundings of numbers up to 1
constexpr double kExact_mm = 1e-11;  // translations near 100 mm, through a solve

double difference(const RigidTransform& a, const RigidTransform& b) {
    return std::max((a.rotation - b.rotation).cwiseAbs().maxCoeff(),
                    (a.translation_mm - b.translation_mm).cwiseAbs().maxCoeff() / 100);
}

Twist random_twist(Random& random, double angle_rad) {
    Twist twist;
    twist << angle_rad * random.direction(), 100 * random.direction();
    return twist;
}

const double kAngles[] = {0, 1e-300, 1e-16, 1e-8, 1e-4, 9.99e-3, 1.001e-2, 0.5, 2, 3.1, kPi - 1e-6, kPi - 1e-10};

TEST(RigidTransform, LogInvertsExp) {
    Random random(1);
    for (const double angle_rad : kAngles) {
        for (int i = 0; i < 20; ++i) {
            const Twist twist = random_twist(random, angle_rad);
            const Twist back = log(exp(twist));
            // Below 1e-16 the rotation rounds to the identity plus its off-diagonals, which keep the angle.
            EXPECT_LT((back - twist).head<3>().norm(), 1e-13) << angle_rad;
            EXPECT_LT((back - twist).tail<3>().norm(), kExact_mm) << angle_rad;
        }
    }
}

TEST(RigidTransform, ExpInvertsLogAtPi) {
    Random random(2);
    for (int i = 0; i < 20; ++i) {
        const RigidTransform turn = exp(random_twist(random, kPi));
        EXPECT_LT(difference(exp(log(turn)), turn), 1e-12);
        EXPECT_NEAR(log(turn).head<3>().norm(), kPi, 1e-12);
    }
}

TEST(RigidTransform, TinyRotationsAreNotLost) {
    const Twist twist = (Twist() << 1e-12, -2e-12, 3e-12, 0, 0, 0).finished();
    EXPECT_LT((log(exp(twist)) - twist).norm(), 1e-24);
}

TEST(RigidTransform, ExpIsTheLimitOfManySmallSteps) {
    // exp(p) = exp(p / 2^k)^(2^k): the definition of an exponential, from its series near zero.
    Random random(3);
    for (const double angle_rad : {0.02, 1.0, 3.0, 6.0}) {
        const Twist twist = random_twist(random, angle_rad);
        RigidTransform product = exp(twist / 4096);
        for (int i = 0; i < 12; ++i) product = product * product;
        EXPECT_LT(difference(product, exp(twist)), 1e-11) << angle_rad;
    }
}

TEST(RigidTransform, RotationIsOrthonormalAndProper) {
    Random random(4);
    for (const double angle_rad : kAngles) {
        const Eigen::Matrix3d r = exp(random_twist(random, angle_rad)).rotation;
        EXPECT_LT((r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), kExact) << angle_rad;
        EXPECT_NEAR(r.determinant(), 1, kExact);
    }
}

TEST(RigidTransform, RotationTurnsCounterClockwise) {
    const RigidTransform quarter = exp((Twist() << 0, 0, kPi / 2, 0, 0, 0).finished());
    EXPECT_LT((quarter * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(0, 1, 0)).norm(), kExact);
}

TEST(RigidTransform, ProductAppliesTheRightOneFirst) {
    Random random(5);
    const RigidTransform b_from_a = exp(random_twist(random, 1)), c_from_b = exp(random_twist(random, 2));
    const Eigen::Vector3d x_a(3, -5, 7);
    EXPECT_LT((c_from_b * b_from_a * x_a - c_from_b * (b_from_a * x_a)).norm(), kExact_mm);
    EXPECT_LT((to_matrix(c_from_b * b_from_a) - to_matrix(c_from_b) * to_matrix(b_from_a)).norm(), kExact_mm);
}

TEST(RigidTransform, ChainWithItsInverseIsTheIdentity) {
    Random random(6);
    RigidTransform chain;
    for (int i = 0; i < 50; ++i) chain = exp(random_twist(random, random.uniform(0, 3))) * chain;
    EXPECT_LT(difference(chain * inverse(chain), {}), 1e-12);
    EXPECT_LT(difference(inverse(chain) * chain, {}), 1e-12);
}

TEST(RigidTransform, TwistAboutACentreKeepsThatCentreButForTheTranslation) {
    const Eigen::Vector3d centre_mm(10, 200, -30);
    const RigidTransform turn = exp_about((Twist() << 0.3, -0.2, 0.5, 0, 0, 0).finished(), centre_mm);
    EXPECT_LT((turn * centre_mm - centre_mm).norm(), kExact_mm);
    const RigidTransform shift = exp_about((Twist() << 0, 0, 0, 1, 2, 3).finished(), centre_mm);
    EXPECT_LT((shift * centre_mm - centre_mm - Eigen::Vector3d(1, 2, 3)).norm(), kExact_mm);
}

TEST(RigidTransform, RotationAngleIsTheTwistsLength) {
    Random random(7);
    for (const double angle_rad : kAngles) {
        EXPECT_NEAR(rotation_angle_rad(exp(random_twist(random, angle_rad))), angle_rad, 1e-13) << angle_rad;
    }
}

TEST(RigidFromMatrix, RoundTrips) {
    Random random(8);
    const RigidTransform b_from_a = exp(random_twist(random, 2.5));
    EXPECT_LT(difference(rigid_from_matrix(to_matrix(b_from_a), "test"), b_from_a), kExact);
}

TEST(RigidFromMatrix, MakesARoundedRotationExact) {
    Random random(9);
    Eigen::Matrix4d matrix = to_matrix(exp(random_twist(random, 1)));
    matrix = (matrix * 1e5).array().round().matrix() / 1e5;  // five decimals
    const Eigen::Matrix3d r = rigid_from_matrix(matrix, "test").rotation;
    EXPECT_LT((r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), kExact);
    EXPECT_LT((r - matrix.topLeftCorner<3, 3>()).cwiseAbs().maxCoeff(), 1e-5);
}

void expect_refused(const Eigen::Matrix4d& matrix, const std::string& reason) {
    EXPECT_THAT(test::error_of([&] { (void)rigid_from_matrix(matrix, "pose.json"); }),
                testing::AllOf(testing::HasSubstr(reason), testing::HasSubstr("pose.json")));
}

TEST(RigidFromMatrix, RefusesWhatIsNotRigid) {
    const Eigen::Matrix4d good = to_matrix(exp((Twist() << 0.1, 0.2, 0.3, 4, 5, 6).finished()));
    Eigen::Matrix4d bad = good;
    bad.col(0) *= -1;
    expect_refused(bad, "mirror");
    bad = good;
    bad.col(0) += 0.01 * bad.col(1);
    expect_refused(bad, "orthonormal");
    bad = good;
    bad.topLeftCorner<3, 3>() *= 1.001;
    expect_refused(bad, "orthonormal");
    bad = good;
    bad(1, 2) = std::numeric_limits<double>::quiet_NaN();
    expect_refused(bad, "finite");
    bad = good;
    bad(0, 3) = std::numeric_limits<double>::infinity();
    expect_refused(bad, "finite");
    bad = good;
    bad(3, 0) = 0.1;
    expect_refused(bad, "last row");
}

TEST(IsFinite, SeesNanAnywhere) {
    RigidTransform transform;
    EXPECT_TRUE(is_finite(transform));
    transform.translation_mm.z() = std::nan("");
    EXPECT_FALSE(is_finite(transform));
    transform = {};
    transform.rotation(2, 1) = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(is_finite(transform));
}

TEST(NearestRotation, OfARotationIsItselfAndIsAlwaysProper) {
    Random random(10);
    const Eigen::Matrix3d r = exp(random_twist(random, 2)).rotation;
    EXPECT_LT((nearest_rotation(r) - r).cwiseAbs().maxCoeff(), kExact);
    EXPECT_LT((nearest_rotation(3 * r) - r).cwiseAbs().maxCoeff(), kExact);
    EXPECT_NEAR(nearest_rotation(-r).determinant(), 1, kExact);
}

}  // namespace
}  // namespace raylign::detail

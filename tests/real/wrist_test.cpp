// Real biplane X-rays of a wrist (tests/support/wrist.h). The bound on the pose is a few times the reference's own
// spread.

#include <gtest/gtest.h>

#include <numbers>

#include "raylign/registration.h"
#include "raylign/targets.h"
#include "tests/support/backends.h"
#include "tests/support/test_data.h"
#include "tests/support/tolerances.h"
#include "tests/support/wrist.h"

namespace raylign::detail {
namespace {

class WristRadius : public testing::TestWithParam<int> {};

TEST_P(WristRadius, IsFoundUnderTheOtherBones) {
    RAYLIGN_NEED_DATA(test::test_data() / "wrist");
    RAYLIGN_MAKE_BACKEND(backend, "cpu");
    const test::Wrist wrist = test::read_wrist(test::test_data() / "wrist", GetParam());
    const auto targets = default_targets_ct_mm(wrist.radius);
    const RigidTransform& reference = wrist.reference_world_from_ct;
    const RigidTransform start = perturbed_start(reference, targets, 9, GetParam());
    const RegistrationResult found = register_volume(wrist.radius, wrist.views, start, {}, *backend);
    EXPECT_EQ(found.content, Content::part);
    EXPECT_TRUE(found.ok) << found.reasons.front();
    const Eigen::Vector3d centre = wrist.radius.grid.centre_ct_mm();
    EXPECT_LT((found.world_from_ct * centre - reference * centre).norm(), test::kWristCentre_mm);
    EXPECT_LT(rotation_angle_rad(found.world_from_ct * inverse(reference)) * 180 / std::numbers::pi,
              test::kWristTurn_deg);
}
INSTANTIATE_TEST_SUITE_P(Instants, WristRadius, testing::Values(2, 99));

}  // namespace
}  // namespace raylign::detail

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "raylign/result.h"

namespace raylign::detail {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

RegistrationResult told_result() {
    RegistrationResult result;
    result.ok = true;
    result.method = Method::gauss_newton;
    result.cost_initial = 0.21084;
    result.cost_final = 0.01234;
    result.iterations = 17;
    result.total_s = 0.314;
    result.confidence.is_estimated = true;
    result.confidence.rim_mm = 0.0421;
    return result;
}

RegistrationResult doubtful_result() {
    RegistrationResult result = told_result();
    result.ok = false;
    result.reasons = {"the first reason", "the second reason"};
    return result;
}

TEST(Brief, IsTheLineThatItsHeaderShows) {
    EXPECT_EQ(brief(told_result()), "ok: cost 0.2108 -> 0.0123, expected error 0.042 mm, 17 iterations, 0.31 s");
}

TEST(Brief, SaysDoubtful) {
    EXPECT_EQ(brief(doubtful_result()),
              "doubtful: cost 0.2108 -> 0.0123, expected error 0.042 mm, 17 iterations, 0.31 s");
}

TEST(Brief, IsSilentOfWhatIsNotKnown) {
    RegistrationResult result = doubtful_result();
    result.confidence = {};
    result.cost_initial = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(brief(result), "doubtful: cost 0.0123, 17 iterations, 0.31 s");
    result.cost_final = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(brief(result), "doubtful, 17 iterations, 0.31 s");
}

TEST(Full, BeginsWithTheVerdict) {
    EXPECT_THAT(full(told_result()), testing::StartsWith("registered\n"));
    EXPECT_THAT(full(doubtful_result()), testing::StartsWith("DOUBTFUL: the result must not be used unchecked\n"));
}

TEST(Full, GivesEveryReasonALine) {
    EXPECT_THAT(full(doubtful_result()), HasSubstr("\n  why       the first reason\n  why       the second reason\n"));
}

TEST(Full, TellsHowFarTheRotationCentreMovedAndTheObjectTurned) {
    RegistrationResult result = told_result();
    result.rotation_centre_ct_mm = {10, -20, 30};
    Twist turn = Twist::Zero();
    turn[2] = -std::numbers::pi / 6;
    result.start_world_from_ct = RigidTransform::translate({100, 0, 0});
    const Eigen::Vector3d centre = result.start_world_from_ct * result.rotation_centre_ct_mm;
    result.world_from_ct = RigidTransform::translate({3, -4, 0}) * exp_about(turn, centre) * result.start_world_from_ct;
    EXPECT_THAT(full(result), AllOf(HasSubstr("\n  moved     5.00 mm  (x +3.00, y -4.00, z +0.00)\n"),
                                    HasSubstr("\n  turned    30.00 deg (x "), HasSubstr(", z -30.00)\n")));
}

TEST(Full, ExplainsTheCost) {
    EXPECT_THAT(full(told_result()), HasSubstr("cost      0.21084 -> 0.01234 (gc: 0 = perfect, 1 = unrelated)\n"));
}

TEST(Full, GivesTheExpectedErrorAndTheWeakestDirection) {
    RegistrationResult result = told_result();
    result.confidence.translation_mm = 0.031;
    result.confidence.rotation_deg = 0.0125;
    result.confidence.weakest_direction = {0, -1, 0};
    result.confidence.weakest_mm = 0.03;
    result.confidence.weakest_axis = {0, 0, 1};
    result.confidence.weakest_deg = 0.011;
    EXPECT_THAT(full(result),
                AllOf(HasSubstr("sigma     0.031 mm, 0.013 deg; weakest along (+0.00, -1.00, +0.00): 0.030 mm, "
                                "about (+0.00, +0.00, +1.00): 0.011 deg\n"),
                      HasSubstr("expected  0.042 mm")));
}

TEST(Full, SaysThatOneViewHardlyTellsDepth) {
    RegistrationResult result = told_result();
    result.confidence.in_plane_mm = 0.15;
    result.confidence.in_depth_mm = 1.4;
    result.confidence.rotation_deg = 0.254;
    EXPECT_THAT(full(result), HasSubstr("expected  0.150 mm in plane, 1.40 mm in depth, 0.25 deg"));
    EXPECT_THAT(full(result), HasSubstr("one view tells depth by size only"));
    EXPECT_THAT(brief(result), HasSubstr("expected error 0.150 mm in plane, 1.40 mm in depth, 0.25 deg"));
}

TEST(Full, WithholdsTheErrorOfADoubtedPose) {
    RegistrationResult result = doubtful_result();
    result.confidence = {.is_withheld = true};
    EXPECT_THAT(full(result), HasSubstr("expected  error not estimated: the pose is doubted"));
    EXPECT_THAT(brief(result), HasSubstr("expected error not estimated as the pose is doubted"));
}

TEST(Full, IsSilentOfWhatIsNotKnown) {
    RegistrationResult result = doubtful_result();
    result.confidence = {};
    result.cost_final = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THAT(full(result), AllOf(Not(HasSubstr("cost")), Not(HasSubstr("sigma")), Not(HasSubstr("expected")),
                                    Not(HasSubstr("nan")), Not(HasSubstr("search"))));
}

TEST(Full, CountsWhatASearchDid) {
    RegistrationResult result = told_result();
    result.search = {.mode = Search::near, .starts = 6144, .refined = 12, .agreeing = 9, .rivals = {{}, {}}};
    EXPECT_THAT(full(result), HasSubstr("search    near: 6144 starts, 12 refined, 9 ended here, 2 rivals\n"));
}

TEST(Full, ListsTheDecisionsAndEndsWithTheTime) {
    RegistrationResult result = told_result();
    result.decisions = {"a choice"};
    result.counters = {.evaluations = 3, .linearizations = 20};
    EXPECT_THAT(full(result),
                testing::EndsWith("  decided   a choice\n"
                                  "  time      0.31 s, gauss-newton, 17 iterations, 23 poses compared\n"));
}

}  // namespace
}  // namespace raylign::detail

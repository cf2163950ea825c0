#include <gtest/gtest.h>

#include <numeric>

#include "core/base/error.h"
#include "core/registration/object/overlap.h"
#include "core/registration/trust/verdict.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

Volume cube(int n, double side_mm, float attenuation = 0.02F) {
    Volume volume;
    volume.grid = centred_grid({n, n, n}, Eigen::Vector3d::Constant(side_mm / n));
    volume.attenuation_per_mm.assign(static_cast<std::size_t>(n) * n * n, attenuation);
    return volume;
}

TEST(ObjectSample, HasTheWeightsOfTheVolume) {
    Volume volume = cube(25, 50);
    // The half with larger x counts three times.
    for (std::size_t i = 0; i < volume.attenuation_per_mm.size(); ++i) {
        if (i % 25 >= 12) volume.attenuation_per_mm[i] = 0.06F;
    }
    const ObjectSample sample = sample_object(volume);
    EXPECT_LE(sample.points_ct_mm.size(), 1728u);
    EXPECT_GT(sample.points_ct_mm.size(), 500u);
    EXPECT_NEAR(std::accumulate(sample.weights.begin(), sample.weights.end(), 0.0), 1, 1e-12);
    double right = 0;
    for (std::size_t i = 0; i < sample.weights.size(); ++i)
        right += sample.points_ct_mm[i].x() > 0 ? sample.weights[i] : 0;
    EXPECT_NEAR(right, 0.75, 0.06);
}

TEST(ObjectSample, OfAnEmptyVolumeIsAnError) { EXPECT_THROW((void)sample_object(cube(8, 10, 0)), Error); }

TEST(ObjectSample, OneVoxelThickVolumesHaveOneLayer) {
    Volume volume;
    volume.grid = centred_grid({30, 1, 7}, {1, 1, 1});
    volume.attenuation_per_mm.assign(210, 0.02F);
    for (const Eigen::Vector3d& point : sample_object(volume).points_ct_mm) EXPECT_NEAR(point.y(), 0, 1e-12);
}

TEST(SeenShare, IsHalfWhereTheDetectorEndsAtTheMiddle) {
    const ObjectSample sample = sample_object(cube(24, 40));
    View view = test::biplane_views(64, 200).front();
    EXPECT_NEAR(seen_share(sample, view, {}), 1, 1e-12);
    view.weights = Image(64, 64, 1);
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 32; ++x) view.weights(x, y) = 0;
    EXPECT_NEAR(seen_share(sample, view, {}), 0.5, 0.05);
    EXPECT_DOUBLE_EQ(seen_share(sample, view, RigidTransform::translate({0, 0, 5000})), 0);
    EXPECT_DOUBLE_EQ(seen_share(sample, view, RigidTransform::translate({0, 5000, 0})), 0);  // behind the source too
}

TEST(Verdict, DoubtsAPartThatIsHardlySeen) {
    const std::vector<View> views = test::biplane_views(16);
    RegistrationResult result;
    result.content = Content::part;
    result.cost_initial = 1;
    result.view_costs = {0.3, 0.3};
    result.overlap = {1, 0.45};
    const auto reasons = doubts(result, views, {}, {});
    ASSERT_EQ(reasons.size(), 1u);
    EXPECT_EQ(reasons[0], "view LAT shows only 45 % of the object on usable pixels");
    result.content = Content::whole;  // a CT may be larger than the field
    EXPECT_TRUE(doubts(result, views, {}, {}).empty());
}

TEST(Overlap, CoverageIsTheShareOfTheImageThatTheObjectsBoxFills) {
    const Volume box = cube(25, 80);
    const ObjectSample sample = sample_object(box);
    View view = test::biplane_views(64).front();
    const double whole = covered_share(sample, view, {});
    EXPECT_GT(whole, 0);
    EXPECT_LT(whole, 1);
    view.weights = Image(64, 64, 1);
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 32; ++x) view.weights(x, y) = 0;
    EXPECT_NEAR(covered_share(sample, view, {}), whole / 2, 0.15 * whole);
    EXPECT_EQ(covered_share(sample, view, RigidTransform::translate({0, 0, 5000})), 0);
}

/// A part that all views show, well determined.
RegistrationResult good_part() {
    RegistrationResult result;
    result.content = Content::part;
    result.cost_initial = 1;
    result.view_costs = {0.7, 0.7};
    result.overlap = {1, 1};
    result.covered = {0.1, 0.1};
    return result;
}

TEST(Verdict, APartThatCoversTheViewMustExplainIt) {
    const std::vector<View> views = test::biplane_views(16);
    RegistrationResult result = good_part();
    EXPECT_TRUE(doubts(result, views, {}, {}).empty());
    result.covered = {0.9, 0.1};
    const auto reasons = doubts(result, views, {}, {});
    ASSERT_EQ(reasons.size(), 1u);
    EXPECT_NE(reasons[0].find("view AP correlates weakly"), std::string::npos);
    EXPECT_NE(reasons[0].find("should explain it"), std::string::npos);
}

TEST(Verdict, APartFoundAnywhereMustFitBetterThanOneFoundNearby) {
    const std::vector<View> views = test::biplane_views(16);
    RegistrationResult result = good_part();
    result.search = {.mode = Search::global, .starts = 1000, .refined = 10, .agreeing = 5};
    EXPECT_EQ(doubts(result, views, {}, {}).size(), 2u);
    result.view_costs = {0.6, 0.6};
    EXPECT_TRUE(doubts(result, views, {}, {}).empty());
}

TEST(Verdict, DoubtsAPartBeyondTheRangeThatWasSearched) {
    const std::vector<View> views = test::biplane_views(16);
    const ObjectExtent extent{.centre_ct_mm = Eigen::Vector3d::Zero(), .radius_mm = 20};
    RegistrationResult result = good_part();
    result.search = {.mode = Search::near, .range_mm = 20, .starts = 1000, .refined = 10, .agreeing = 5};
    result.world_from_ct = RigidTransform::translate({0, 19, 0});
    EXPECT_TRUE(doubts(result, views, {}, extent).empty());
    result.world_from_ct = RigidTransform::translate({0, 21, 0});
    const auto reasons = doubts(result, views, {}, extent);
    ASSERT_EQ(reasons.size(), 1u);
    EXPECT_NE(reasons[0].find("beyond the 20 mm that were searched"), std::string::npos);
}

TEST(Verdict, NamesAReversedContrast) {
    const std::vector<View> views = test::biplane_views(16);
    RegistrationResult result = good_part();
    result.view_costs = {1.4, 0.7};
    const auto reasons = doubts(result, views, {}, {});
    ASSERT_EQ(reasons.size(), 1u);
    EXPECT_NE(reasons[0].find("polarity"), std::string::npos);
}

TEST(Verdict, AnErrorThatCouldNotBeEstimatedIsNotSmall) {
    const std::vector<View> views = test::biplane_views(16);
    RegistrationResult result = good_part();
    result.method = Method::gauss_newton;
    EXPECT_EQ(doubts(result, views, {}, {}).size(), 1u);
    result.confidence.is_estimated = true;
    EXPECT_TRUE(doubts(result, views, {}, {}).empty());
}

}  // namespace
}  // namespace raylign::detail

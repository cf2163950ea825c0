#include "core/registration/overlap.h"

#include <gtest/gtest.h>

#include <numeric>

#include "core/error.h"
#include "core/registration/verdict.h"
#include "tests/support/scenes.h"

namespace raylign {
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
    result.view_costs = {0.4, 0.4};
    result.overlap = {1, 0.45};
    const auto reasons = doubts(result, views, {}, {});
    ASSERT_EQ(reasons.size(), 1u);
    EXPECT_EQ(reasons[0], "view LAT shows only 45 % of the object on usable pixels");
    result.content = Content::whole;  // a CT may be larger than the field
    EXPECT_TRUE(doubts(result, views, {}, {}).empty());
}

}  // namespace
}  // namespace raylign

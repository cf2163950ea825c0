#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/registration/strategy/candidates.h"
#include "raylign/backends.h"
#include "raylign/targets.h"
#include "tests/support/scenes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail {
namespace {

const ObjectExtent kExtent{.centre_ct_mm = {3, -4, 5}, .thickness_mm = 30, .radius_mm = 40};

bool is_same(const RigidTransform& a, const RigidTransform& b) { return to_matrix(a) == to_matrix(b); }

TEST(PosesNear, BeginWithTheCentreAndStayInRange) {
    const RigidTransform centre = test::oblique_pose();
    const auto poses = poses_near(centre, kExtent, 25, 0.3, 500, 7);
    ASSERT_EQ(poses.size(), 500u);
    EXPECT_TRUE(is_same(poses[0], centre));
    double farthest_mm = 0, largest_rad = 0;
    for (const RigidTransform& pose : poses) {
        farthest_mm = std::max(farthest_mm, apart_mm(pose, centre, kExtent));
        largest_rad = std::max(largest_rad, rotation_angle_rad(pose * inverse(centre)));
    }
    EXPECT_LE(farthest_mm, 25 + 1e-9);
    EXPECT_GT(farthest_mm, 22);
    EXPECT_LE(largest_rad, 0.3 + 1e-9);
    EXPECT_GT(largest_rad, 0.29);
}

TEST(PosesNear, AreTheSameForTheSameSeedOnly) {
    const auto a = poses_near({}, kExtent, 10, 1, 20, 3), b = poses_near({}, kExtent, 10, 1, 20, 3),
               c = poses_near({}, kExtent, 10, 1, 20, 4);
    for (int i = 0; i < 20; ++i) EXPECT_TRUE(is_same(a[i], b[i]));
    EXPECT_GT(apart_mm(a[5], c[5], kExtent), 0.1);
}

TEST(PosesInView, PutTheObjectWhereAllViewsSeeIt) {
    const std::vector<View> views = test::biplane_views(64, 200);
    const auto poses = poses_in_view({}, kExtent, views, 0.6, 300, 1);
    double spread_mm = 0;
    for (const RigidTransform& pose : poses) {
        const Eigen::Vector3d centre = pose * kExtent.centre_ct_mm;
        spread_mm = std::max(spread_mm, centre.cwiseAbs().maxCoeff());
        EXPECT_LE(rotation_angle_rad(pose), 0.6 + 1e-9);
        for (const View& view : views) {
            const Eigen::Vector2d p = project(view.geometry, centre);
            EXPECT_TRUE((p.array() > -0.51).all() && (p.array() < 63.51).all()) << p.transpose();
        }
    }
    EXPECT_GT(spread_mm, 80);  // half of a field of 200 mm, about
}

TEST(PosesInView, AreDrawnInOneOrderByEveryCompiler) {
    const std::vector<View> views = test::biplane_views(64, 200);
    const RigidTransform drawn = poses_in_view({}, kExtent, views, 0.6, 2, 3)[1];
    Random random(3);  // its first pose is in view
    const double z = random.uniform(-0.5, 0.5), y = random.uniform(-0.5, 0.5), x = random.uniform(-0.5, 0.5);
    const Eigen::Vector3d axis = random.direction();
    const Eigen::Vector3d shift_mm = field_mm(views, kExtent.centre_ct_mm) * Eigen::Vector3d(x, y, z);
    EXPECT_LT((drawn * kExtent.centre_ct_mm - kExtent.centre_ct_mm - shift_mm).norm(), 1e-9);
    EXPECT_LT((drawn.rotation * axis - axis).norm(), 1e-12);
    EXPECT_NEAR(rotation_angle_rad(drawn), 0.6 * std::cbrt(random.uniform()), 1e-9);
}

TEST(PosesInView, ViewsThatShareNothingAreAnError) {
    std::vector<View> views = test::biplane_views(16, 20);
    views[1].geometry.camera_from_world = views[1].geometry.camera_from_world * RigidTransform::translate({0, 0, 500});
    EXPECT_THROW((void)poses_in_view({}, kExtent, views, 0.6, 10, 1), Error);
}

TEST(Distinct, CountsWhatAgreesAndKeepsTheBest) {
    const auto at = [](double x, double cost) { return Candidate{RigidTransform::translate({x, 0, 0}), cost, 1}; };
    const auto kept = distinct({at(0, 0.5), at(10, 0.3), at(0.5, 0.4), at(10.5, 0.35), at(30, 0.9)}, kExtent, 2);
    ASSERT_EQ(kept.size(), 3u);
    EXPECT_EQ(kept[0].cost, 0.3);
    EXPECT_EQ(kept[0].agreeing, 2);
    EXPECT_EQ(kept[1].cost, 0.4);
    EXPECT_EQ(kept[1].agreeing, 2);
    EXPECT_EQ(kept[2].agreeing, 1);
}

struct Scene32 {
    Volume volume = test::spine_volume(32);
    RigidTransform truth = test::oblique_pose();
    std::vector<View> views = test::with_exact_images(test::biplane_views(48), spine_phantom({160, 160, 160}), truth);
    std::unique_ptr<Backend> backend = create_backend("cpu").backend;
    std::unique_ptr<Session> session = backend->prepare({volume, views, {}, {Metric::gc, {1.5, 5}}});
    ObjectExtent extent = object_extent(volume);
    LevelProblem problem{.session = *session,
                         .start_world_from_ct = truth,
                         .extent = extent,
                         .pixel_at_object_mm = 4,
                         .initial_step_mm = 4,
                         .step_tolerance_mm = 0.01,
                         .cost_tolerance = 1e-8,
                         .max_iterations = 20,
                         .before_batch = [] {}};
};

TEST(GaussNewtonBatch, EndsWhereEachStartEndsAlone) {
    Scene32 s;
    const auto starts = poses_near(s.truth, s.extent, 12, 0.2, 5, 2);
    const auto together = run_gauss_newton_batch(s.problem, starts);
    ASSERT_EQ(together.size(), starts.size());
    for (std::size_t i = 0; i < starts.size(); ++i) {
        LevelProblem alone = s.problem;
        alone.start_world_from_ct = starts[i];
        const LevelOutcome one = run_gauss_newton(alone, {});
        EXPECT_TRUE(is_same(one.world_from_ct, together[i].world_from_ct));
        EXPECT_EQ(one.cost, together[i].cost);
        EXPECT_EQ(one.iterations, together[i].iterations);
    }
}

TEST(BestOf, GivesTheLeastCostsInOrder) {
    Scene32 s;
    const auto poses = poses_near(s.truth, s.extent, 20, 0.5, 600, 2);  // more than one batch
    const auto best = best_of(s.problem, poses, 5);
    ASSERT_EQ(best.size(), 5u);
    std::vector<double> costs(poses.size());
    s.session->evaluate(poses, costs);
    std::ranges::sort(costs);
    for (int i = 0; i < 5; ++i) EXPECT_EQ(best[i].cost, costs[i]);
    EXPECT_LT(apart_mm(best[0].world_from_ct, s.truth, s.extent), test::kBestOfSample_mm);
}

}  // namespace
}  // namespace raylign::detail

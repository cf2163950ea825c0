#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/base/error.h"
#include "core/base/random.h"
#include "raylign/backends.h"
#include "raylign/registration.h"
#include "raylign/targets.h"
#include "tests/support/errors.h"
#include "tests/support/scenes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail {
namespace {

/// Small enough for the reference backend: 32^3 voxels of 5 mm, two 48 x 48 views with exact X-rays of the phantom.
struct SmallCase {
    Volume volume = test::spine_volume(32);
    RigidTransform truth = test::oblique_pose();
    std::vector<View> views = test::with_exact_images(test::biplane_views(48), spine_phantom({160, 160, 160}), truth);
    std::vector<Eigen::Vector3d> targets = default_targets_ct_mm(volume);
    BackendChoice choice = create_backend("reference");

    RegistrationResult run(const RigidTransform& start, const RegistrationOptions& options = {},
                           const RunControl& control = {}) {
        return register_volume(volume, views, start, options, *choice.backend, control);
    }
    [[nodiscard]] double mtre_mm(const RigidTransform& pose) const {
        return mean_target_error_mm(pose, truth, targets);
    }
};

TEST(Registration, RecoversAKnownPoseBelowHalfAVoxel) {
    SmallCase c;
    const RegistrationResult result = c.run(perturbed_start(c.truth, c.targets, 8, 1));
    EXPECT_TRUE(result.ok) << (result.reasons.empty() ? "" : result.reasons.front());
    EXPECT_LT(c.mtre_mm(result.world_from_ct), 2.5);
    EXPECT_LT(c.mtre_mm(result.world_from_ct), test::kSmallSpineMtre_mm) << "no less accurate than it was";
    EXPECT_LT(result.cost_final, result.cost_initial);
}

TEST(Registration, BothMethodsEndAtTheSamePose) {
    SmallCase c;
    const RigidTransform start = perturbed_start(c.truth, c.targets, 8, 1);
    const RegistrationResult descent = c.run(start, {.method = Method::steepest_descent});
    const RegistrationResult newton =
        c.run(start, {.method = Method::gauss_newton, .look_around = false, .compare_views = false});
    EXPECT_EQ(descent.method, Method::steepest_descent);
    EXPECT_EQ(newton.method, Method::gauss_newton);
    EXPECT_TRUE(newton.ok);
    EXPECT_LT(newton.counters.linearizations, 40u);
    EXPECT_GT(newton.counters.linearizations, 2u);
    EXPECT_LT(mean_target_error_mm(newton.world_from_ct, descent.world_from_ct, c.targets), test::kTwoMethodsMtre_mm)
        << "the cost is flat to 1e-7 there, and interpolation has kinks";
    EXPECT_LE(newton.cost_final, descent.cost_final + 1e-7);
}

TEST(Registration, TheSameInputGivesTheSameBits) {
    SmallCase c;
    const RigidTransform start = perturbed_start(c.truth, c.targets, 8, 2);
    const RegistrationResult a = c.run(start), b = c.run(start);
    EXPECT_EQ(to_matrix(a.world_from_ct), to_matrix(b.world_from_ct));
    EXPECT_EQ(a.cost_final, b.cost_final);
    EXPECT_EQ(a.counters.evaluations, b.counters.evaluations);
}

TEST(Registration, EvaluatesNoPoseTwiceOnALevel) {
    SmallCase c;
    c.views = test::with_exact_images(test::biplane_views(64), spine_phantom({160, 160, 160}), c.truth);
    const RigidTransform start = perturbed_start(c.truth, c.targets, 6, 3);
    const RegistrationResult result = c.run(start, {.robust = false, .look_around = false, .compare_views = false});
    ASSERT_EQ(result.levels.size(), 2u);
    EXPECT_EQ(result.counters.evaluations, 4u) << "the start on either level, twice about its cut sides on the first";
    const auto session = c.choice.backend->prepare({c.volume, c.views, {}, {}});
    double cost = 0;
    session->evaluate({&start, 1}, {&cost, 1});
    EXPECT_NEAR(result.cost_initial, cost, 1e-12) << "what is remembered is what it was";
    const std::array<double, 2> ends{result.view_costs.at(0), result.view_costs.at(1)};
    EXPECT_NEAR((ends[0] + ends[1]) / 2, result.cost_final, 1e-12);
    session->evaluate({&result.world_from_ct, 1}, {&cost, 1});
    EXPECT_NEAR(result.cost_final, cost, 1e-12);
}

TEST(Registration, ReportsEveryLevelAndStep) {
    SmallCase c;
    c.views = test::with_exact_images(test::biplane_views(64), spine_phantom({160, 160, 160}), c.truth);
    int calls = 0;
    double last_fraction = 0;
    const RegistrationResult result =
        c.run(perturbed_start(c.truth, c.targets, 6, 3),
              {.max_iterations_per_level = 5, .look_around = false, .compare_views = false},
              {.on_progress = [&](const RegistrationProgress& p) {
                  ++calls;
                  EXPECT_EQ(p.levels, 2);
                  EXPECT_GE(p.fraction, last_fraction);
                  EXPECT_LE(p.fraction, 1);
                  last_fraction = p.fraction;
              }});
    ASSERT_EQ(result.levels.size(), 2u);
    EXPECT_EQ(result.levels[0].image_sizes_px[0], Eigen::Vector2i(32, 32));
    EXPECT_EQ(result.levels[1].image_sizes_px[0], Eigen::Vector2i(64, 64));
    EXPECT_EQ(calls, result.iterations);
    EXPECT_EQ(result.history.size(), static_cast<std::size_t>(result.iterations));
    std::uint64_t evaluations = 0;
    for (const LevelReport& level : result.levels) evaluations += level.evaluations;
    EXPECT_EQ(evaluations, result.counters.evaluations);
    EXPECT_EQ(result.view_costs.size(), 2u);
}

TEST(Registration, TimesOfLevelsAddUp) {
    SmallCase c;
    c.choice = create_backend("cpu");
    for (View& view : c.views) {  // a box over the spine: it is finished with a fine filter, on a level in another
        const Image box = exact_drr(box_phantom({40, 60, 30}), view.geometry, RigidTransform::translate({30, 20, 10}));
        for (std::size_t i = 0; i < box.pixels.size(); ++i) view.image.pixels[i] += 6 * box.pixels[i];
    }
    const RegistrationResult result = c.run(perturbed_start(c.truth, c.targets, 4, 3));
    ASSERT_FALSE(result.decisions.empty());
    ASSERT_EQ(result.levels.size(), 2u) << full(result);
    double sum_s = 0;
    for (const LevelReport& level : result.levels) {
        EXPECT_GT(level.time_s, 0);
        sum_s += level.time_s;
    }
    EXPECT_LE(sum_s, result.total_s);
}

TEST(Registration, StopsAtTheCallersWish) {
    SmallCase c;
    StopSource source;
    const RegistrationResult result =
        c.run(perturbed_start(c.truth, c.targets, 8, 4), {},
              {.on_progress = [&](const RegistrationProgress&) { source.request_stop(); }, .stop = source.token()});
    EXPECT_EQ(result.termination, Termination::stopped);
    EXPECT_FALSE(result.ok);
    ASSERT_EQ(result.history.size(), 1u) << "the step after which it was asked is kept";
    EXPECT_EQ(to_matrix(result.world_from_ct), to_matrix(result.history.front().world_from_ct));
    EXPECT_NE(result.reasons.front().find("stopped by the caller"), std::string::npos);
}

TEST(Registration, TooFewIterationsAreDoubtfulWithAReason) {
    SmallCase c;
    const RegistrationResult result = c.run(perturbed_start(c.truth, c.targets, 8, 5), {.max_iterations_per_level = 1});
    EXPECT_FALSE(result.ok);
    ASSERT_FALSE(result.reasons.empty());
    EXPECT_NE(result.reasons.front().find("max-iterations"), std::string::npos);
}

TEST(Registration, StopsBeforeTheNextBatchWhenAsked) {
    SmallCase c;
    int batches = 0;
    StopSource source;
    const RegistrationResult result =
        c.run(perturbed_start(c.truth, c.targets, 8, 4), {}, {.stop = source.token(), .meanwhile = [&] {
                                                                  if (++batches == 3) source.request_stop();
                                                              }});
    EXPECT_EQ(result.termination, Termination::stopped);
    EXPECT_EQ(batches, 3);
}

TEST(Registration, AStopBeforeTheFirstBatchGivesTheStart) {
    SmallCase c;
    StopSource source;
    source.request_stop();
    const RigidTransform start = perturbed_start(c.truth, c.targets, 8, 4);
    const RegistrationResult result = c.run(start, {}, {.stop = source.token()});
    EXPECT_EQ(to_matrix(result.world_from_ct), to_matrix(start));
    EXPECT_FALSE(result.ok);
}

TEST(Registration, AFarResultIsDoubtfulUnlessOneHasLookedAround) {
    SmallCase c;
    // 50 degrees off about the long axis of the spine, farther than starts without a search have been tested: the truth
    // is found.
    Twist turn = Twist::Zero();
    turn[2] = 0.9;
    const RegistrationResult blind = c.run(exp(turn) * c.truth, {.look_around = false});
    ASSERT_LT(c.mtre_mm(blind.world_from_ct), 2.5);
    EXPECT_FALSE(blind.ok);
    EXPECT_THAT(blind.reasons, testing::Contains(testing::HasSubstr("far from the start")));
    const RegistrationResult result = c.run(exp(turn) * c.truth);
    EXPECT_TRUE(result.ok) << (result.reasons.empty() ? "" : result.reasons.front());
    EXPECT_GT(result.search.agreeing, 4) << "starts around it ended there";
    EXPECT_THAT(result.search.rivals, testing::Each(testing::Field(&Rival::cost, testing::Gt(result.search.cost))));
}

TEST(Registration, UnrelatedImagesAreDoubtful) {
    SmallCase c;
    Random random(5);
    for (View& view : c.views) {
        for (float& pixel : view.image.pixels) pixel = static_cast<float>(random.uniform());
    }
    // Without a search and mirrored tries: the reference backend is slow.
    const RegistrationResult result = c.run(c.truth, {.search = {.mode = Search::none}, .suspect_mirrored = false});
    EXPECT_FALSE(result.ok);
    ASSERT_FALSE(result.reasons.empty());
    EXPECT_NE(result.reasons.front().find("correlates weakly"), std::string::npos) << result.reasons.front();
}

TEST(Registration, AStartThatMissesTheDetectorIsAnErrorNamingTheView) {
    SmallCase c;
    const std::string message = test::error_of([&] { (void)c.run(RigidTransform::translate({0, 0, 900})); });
    EXPECT_NE(message.find("misses the detector of view AP"), std::string::npos) << message;
}

TEST(Registration, AnObjectThatCoversTheDetectorIsAnErrorOfItsOwn) {
    SmallCase c;
    std::ranges::fill(c.volume.attenuation_per_mm, 1.F);
    c.volume.grid = centred_grid(c.volume.grid.size, Eigen::Vector3d::Constant(20));
    for (View& view : c.views) view.ceiling = 0.5;
    const std::string message = test::error_of([&] { (void)c.run(c.truth); });
    EXPECT_NE(message.find("same on all usable pixels of view AP"), std::string::npos) << message;
    EXPECT_EQ(message.find("misses"), std::string::npos) << message;
}

TEST(Registration, BadInputIsRefusedWithWhatAndWhere) {
    SmallCase c;
    const RigidTransform start = c.truth;
    RigidTransform nan_pose;
    nan_pose.translation_mm.x() = std::nan("");
    EXPECT_NE(test::error_of([&] { (void)c.run(nan_pose); }).find("start pose"), std::string::npos);
    EXPECT_NE(test::error_of([&] { (void)c.run(start, {.levels = 9}); }).find("levels = 9"), std::string::npos);
    EXPECT_NE(test::error_of([&] { (void)c.run(start, {.max_iterations_per_level = 0}); }).find("max_iterations"),
              std::string::npos);

    SmallCase constant;
    constant.views[1].image.pixels.assign(constant.views[1].image.pixels.size(), 0.5F);
    EXPECT_NE(test::error_of([&] { (void)constant.run(start); }).find("view LAT: the image is constant"),
              std::string::npos);

    SmallCase no_image;
    no_image.views[0].image = {};
    EXPECT_NE(test::error_of([&] { (void)no_image.run(start); }).find("image"), std::string::npos);

    SmallCase wrong_size;
    wrong_size.views[0].image = Image(47, 48, 1);
    EXPECT_NE(test::error_of([&] { (void)wrong_size.run(start); }).find("47 x 48"), std::string::npos);

    SmallCase masked;
    masked.views[0].weights = Image(48, 48, 0);
    EXPECT_NE(test::error_of([&] { (void)masked.run(start); }).find("usable pixels"), std::string::npos);

    SmallCase nan_voxel;
    nan_voxel.volume.attenuation_per_mm[nan_voxel.volume.index(3, 2, 1)] = std::nanf("");
    EXPECT_NE(test::error_of([&] { (void)nan_voxel.run(start); }).find("voxel (3, 2, 1)"), std::string::npos);

    SmallCase no_views;
    no_views.views.clear();
    EXPECT_NE(test::error_of([&] { (void)no_views.run(start); }).find("views"), std::string::npos);
}

}  // namespace
}  // namespace raylign::detail

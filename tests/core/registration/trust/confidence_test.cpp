#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <numbers>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"
#include "core/base/random.h"
#include "core/registration/trust/confidence.h"
#include "raylign/backends.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

/// The X-rays are the session's own DRRs at the truth, so that without noise nothing is left to explain.
struct JackknifeCase {
    explicit JackknifeCase(double noise_share = 0) {
        const auto renderer = backend->prepare({volume, views, {}, {}});
        Random random(17);
        for (std::size_t v = 0; v < views.size(); ++v) {
            views[v].image = renderer->render(truth, v);
            const float most = *std::ranges::max_element(views[v].image.pixels);
            for (float& p : views[v].image.pixels) p += static_cast<float>(noise_share * most * random.normal());
        }
        make_session();
    }
    void make_session() { session = backend->prepare({volume, views, {}, {Metric::gc, {1.5, 4}}}); }
    [[nodiscard]] LevelProblem problem(std::function<void()> before_batch = [] {}) const {
        return {.session = *session,
                .start_world_from_ct = truth,
                .extent = extent,
                .pixel_at_object_mm = 4,
                .initial_step_mm = 4,
                .step_tolerance_mm = 0.01,
                .cost_tolerance = 1e-8,
                .max_iterations = 20,
                .before_batch = std::move(before_batch)};
    }
    [[nodiscard]] std::vector<std::vector<float>> weights() const {
        std::vector<std::vector<float>> all;
        for (std::size_t v = 0; v < views.size(); ++v) all.push_back(session->fixed_channels(v).weights.pixels);
        return all;
    }
    /// Weights that differ from those of the masks.
    void weigh_unevenly() const {
        Image uneven(48, 48, 1);
        for (std::size_t i = 0; i < uneven.pixels.size(); ++i) uneven.pixels[i] = 0.25F + static_cast<float>(i % 7);
        session->set_weights(std::vector<Image>{uneven, uneven});
    }

    Volume volume = test::spine_volume(32);
    RigidTransform truth = test::oblique_pose();
    std::vector<View> views = test::biplane_views(48);
    ObjectExtent extent = object_extent(volume);
    std::unique_ptr<Backend> backend = create_backend("cpu").backend;
    std::unique_ptr<Session> session;
};

TEST(Jackknife, CovarianceIsSymmetricAndPositive) {
    const JackknifeCase c(0.01);
    const Confidence confidence = jackknife(c.problem(), c.truth, 1);
    ASSERT_TRUE(confidence.is_estimated);
    EXPECT_LT((confidence.covariance - confidence.covariance.transpose()).norm(), 1e-12 * confidence.covariance.norm());
    EXPECT_EQ(Eigen::LLT<Matrix6>(confidence.covariance).info(), Eigen::Success);
}

TEST(Jackknife, IsSureWhereNothingIsLeftToExplain) {
    const JackknifeCase c;
    const Confidence confidence = jackknife(c.problem(), c.truth, 1);
    ASSERT_TRUE(confidence.is_estimated);
    EXPECT_LT(confidence.rim_mm, 1e-3);
}

TEST(Jackknife, DoublesWithTheNoise) {
    // To first order in the noise: the steps are linear in it around a perfect match.
    const JackknifeCase one(0.001), two(0.002);
    const double single_mm = jackknife(one.problem(), one.truth, 1).rim_mm;
    EXPECT_GT(single_mm, 1e-3);
    EXPECT_NEAR(jackknife(two.problem(), two.truth, 1).rim_mm / single_mm, 2, 0.05);
}

TEST(Jackknife, CalibrationCountsSquaredInTheCovariance) {
    const JackknifeCase c(0.01);
    const Confidence one = jackknife(c.problem(), c.truth, 1), three = jackknife(c.problem(), c.truth, 3);
    EXPECT_LT((three.covariance - 9 * one.covariance).norm(), 1e-12 * three.covariance.norm());
    EXPECT_NEAR(three.rim_mm, 3 * one.rim_mm, 1e-12 * three.rim_mm);
}

TEST(Jackknife, SummaryFollowsFromTheCovariance) {
    const JackknifeCase c(0.01);
    const Confidence found = jackknife(c.problem(), c.truth, 1);
    const double turn2 = found.covariance.topLeftCorner<3, 3>().trace();
    const double shift2 = found.covariance.bottomRightCorner<3, 3>().trace();
    EXPECT_NEAR(found.translation_mm * found.translation_mm, shift2, 1e-12 * shift2);
    EXPECT_NEAR(found.rotation_deg, std::sqrt(turn2) * 180 / std::numbers::pi, 1e-12 * found.rotation_deg);
    const double rim2 = shift2 + 0.4 * c.extent.radius_mm * c.extent.radius_mm * turn2;
    EXPECT_NEAR(found.rim_mm * found.rim_mm, rim2, 1e-12 * rim2);
}

TEST(Jackknife, WeakestDirectionHasTheLargestSigma) {
    const JackknifeCase c(0.01);
    const Confidence found = jackknife(c.problem(), c.truth, 1);
    const Eigen::Matrix3d shift = found.covariance.bottomRightCorner<3, 3>();
    EXPECT_NEAR(found.weakest_direction.norm(), 1, 1e-12);
    const double along = found.weakest_direction.dot(shift * found.weakest_direction);
    EXPECT_NEAR(found.weakest_mm * found.weakest_mm, along, 1e-9 * along);
    for (int axis = 0; axis < 3; ++axis) EXPECT_GE(along, shift(axis, axis));
}

TEST(Jackknife, LinearizesOncePerGroup) {
    const JackknifeCase c(0.01);
    int batches = 0;
    const auto before = c.session->counters().linearizations;
    (void)jackknife(c.problem([&] { ++batches; }), c.truth, 1);
    EXPECT_EQ(batches, 16);
    EXPECT_EQ(c.session->counters().linearizations - before, 16u);
}

TEST(Jackknife, LeavesTheWeightsAsTheyWere) {
    const JackknifeCase c(0.01);
    c.weigh_unevenly();
    const auto before = c.weights();
    (void)jackknife(c.problem(), c.truth, 1);
    EXPECT_EQ(c.weights(), before);
}

TEST(Jackknife, LeavesTheWeightsAsTheyWereWhereItIsStopped) {
    struct Stop {};  // like the driver's own, no Error
    const JackknifeCase c(0.01);
    c.weigh_unevenly();
    const auto before = c.weights();
    int batches = 0;
    const auto stop = [&] {
        if (++batches == 5) throw Stop{};
    };
    EXPECT_THROW((void)jackknife(c.problem(stop), c.truth, 1), Stop);
    EXPECT_EQ(c.weights(), before);
}

TEST(Jackknife, PassesOnAFaultOfTheBackend) {
    const JackknifeCase c(0.01);
    c.weigh_unevenly();
    const auto before = c.weights();
    const auto fault = [] { throw Error("the device is gone", ErrorKind::unavailable); };
    EXPECT_THROW((void)jackknife(c.problem(fault), c.truth, 1), Error);
    EXPECT_EQ(c.weights(), before);
}

TEST(Jackknife, IsNotEstimatedWhereAGroupHoldsNearlyAllPixels) {
    const JackknifeCase c(0.01);
    // The box is the image for its corners; all else lies in one of its 8 x 8 blocks of 6 x 6 pixels.
    Image clustered(48, 48, 0);
    clustered(0, 0) = clustered(47, 47) = 1;
    for (int y = 24; y < 30; ++y) {
        for (int x = 18; x < 24; ++x) clustered(x, y) = 1;
    }
    c.session->set_weights(std::vector<Image>{clustered, clustered});
    const auto before = c.weights();
    const Confidence found = jackknife(c.problem(), c.truth, 1);
    EXPECT_FALSE(found.is_estimated);
    EXPECT_EQ(found.rim_mm, 0);
    EXPECT_EQ(c.weights(), before);
}

}  // namespace
}  // namespace raylign::detail

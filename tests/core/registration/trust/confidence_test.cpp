#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <numbers>

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
    [[nodiscard]] std::vector<ViewSums> sums(const std::function<void()>& before_view = [] {}) const {
        return pose_sums(*session, truth, extent.centre_ct_mm, before_view);
    }
    [[nodiscard]] Confidence jackknifed(double calibration) const {
        return jackknife(sums(), std::vector<double>(views.size(), 1.0 / static_cast<double>(views.size())),
                         extent.radius_mm, calibration);
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
    const Confidence confidence = c.jackknifed(1);
    ASSERT_TRUE(confidence.is_estimated);
    EXPECT_LT((confidence.covariance - confidence.covariance.transpose()).norm(), 1e-12 * confidence.covariance.norm());
    EXPECT_EQ(Eigen::LLT<Matrix6>(confidence.covariance).info(), Eigen::Success);
}

TEST(Jackknife, IsSureWhereNothingIsLeftToExplain) {
    const JackknifeCase c;
    const Confidence confidence = c.jackknifed(1);
    ASSERT_TRUE(confidence.is_estimated);
    EXPECT_LT(confidence.rim_mm, 1e-3);
}

TEST(Jackknife, DoublesWithTheNoise) {
    // To first order in the noise: the steps are linear in it around a perfect match.
    const JackknifeCase one(0.001), two(0.002);
    const double single_mm = one.jackknifed(1).rim_mm;
    EXPECT_GT(single_mm, 1e-3);
    EXPECT_NEAR(two.jackknifed(1).rim_mm / single_mm, 2, 0.05);
}

TEST(Jackknife, CalibrationCountsSquaredInTheCovariance) {
    const JackknifeCase c(0.01);
    const Confidence one = c.jackknifed(1), three = c.jackknifed(3);
    EXPECT_LT((three.covariance - 9 * one.covariance).norm(), 1e-12 * three.covariance.norm());
    EXPECT_NEAR(three.rim_mm, 3 * one.rim_mm, 1e-12 * three.rim_mm);
}

TEST(Jackknife, SummaryFollowsFromTheCovariance) {
    const JackknifeCase c(0.01);
    const Confidence found = c.jackknifed(1);
    const double turn2 = found.covariance.topLeftCorner<3, 3>().trace();
    const double shift2 = found.covariance.bottomRightCorner<3, 3>().trace();
    EXPECT_NEAR(found.translation_mm * found.translation_mm, shift2, 1e-12 * shift2);
    EXPECT_NEAR(found.rotation_deg, std::sqrt(turn2) * 180 / std::numbers::pi, 1e-12 * found.rotation_deg);
    const double rim2 = shift2 + 0.4 * c.extent.radius_mm * c.extent.radius_mm * turn2;
    EXPECT_NEAR(found.rim_mm * found.rim_mm, rim2, 1e-12 * rim2);
}

TEST(Jackknife, WeakestDirectionHasTheLargestSigma) {
    const JackknifeCase c(0.01);
    const Confidence found = c.jackknifed(1);
    const Eigen::Matrix3d shift = found.covariance.bottomRightCorner<3, 3>();
    EXPECT_NEAR(found.weakest_direction.norm(), 1, 1e-12);
    const double along = found.weakest_direction.dot(shift * found.weakest_direction);
    EXPECT_NEAR(found.weakest_mm * found.weakest_mm, along, 1e-9 * along);
    for (int axis = 0; axis < 3; ++axis) EXPECT_GE(along, shift(axis, axis));
}

/// The weights of a view without a group, pixel by pixel.
Image without_group(const Image& weights, int group) {
    int x0 = weights.width, y0 = weights.height, x1 = 0, y1 = 0;
    for (int y = 0; y < weights.height; ++y) {
        for (int x = 0; x < weights.width; ++x) {
            if (weights(x, y) == 0) continue;
            x0 = std::min(x0, x), y0 = std::min(y0, y), x1 = std::max(x1, x + 1), y1 = std::max(y1, y + 1);
        }
    }
    Image rest = weights;
    for (int y = y0; y < y1; ++y) {
        for (int x = x0; x < x1; ++x) {
            if (group_of((x - x0) * 8 / (x1 - x0), (y - y0) * 8 / (y1 - y0)) == group) rest(x, y) = 0;
        }
    }
    return rest;
}

/// Sums in float against sums in double: relative, of the whole.
void expect_alike(const Linearization& sums, const Linearization& session, const char* what) {
    constexpr double kRelative = 2e-5;
    EXPECT_NEAR(sums.cost, session.cost, kRelative) << what;
    EXPECT_LT((sums.gradient - session.gradient).norm(), kRelative * std::sqrt(session.curvature.norm())) << what;
    EXPECT_LT((sums.curvature - session.curvature).norm(), kRelative * session.curvature.norm()) << what;
}

TEST(PoseSums, AreWhatASessionGivesWithoutEachGroup) {
    const JackknifeCase c(0.02);
    c.weigh_unevenly();
    const std::vector<ViewSums> sums = c.sums();
    const std::vector<Image> weights = {c.session->fixed_channels(0).weights, c.session->fixed_channels(1).weights};
    std::vector<Linearization> at(2);
    const auto linearize = [&] { c.session->linearize_views({&c.truth, 1}, c.extent.centre_ct_mm, at); };
    linearize();
    for (std::size_t v = 0; v < 2; ++v) expect_alike(sums[v].all, at[v], "all");
    for (int group = 0; group < kGroups; ++group) {
        c.session->set_weights(std::vector<Image>{without_group(weights[0], group), without_group(weights[1], group)});
        linearize();
        for (std::size_t v = 0; v < 2; ++v) expect_alike(sums[v].without[group], at[v], "without a group");
    }
}

TEST(PoseSums, TakeTheDistortedDrrForTheXray) {
    JackknifeCase c(0.02);
    const std::vector<ViewSums> sums = c.sums();
    for (const Distortion distortion : {Distortion::blur, Distortion::scatter, Distortion::hardening}) {
        std::vector<View> views = c.views;
        for (std::size_t v = 0; v < 2; ++v) views[v].image = distorted(distortion, c.session->render(c.truth, v));
        const auto session = c.session->with_views(views, {Metric::gc, {1.5, 4}});
        std::vector<Linearization> at(2);
        session->linearize_views({&c.truth, 1}, c.extent.centre_ct_mm, at);
        for (std::size_t v = 0; v < 2; ++v) {
            EXPECT_GT(at[v].cost, 1e-5);
            expect_alike(sums[v].distorted[static_cast<std::size_t>(distortion)], at[v], "distorted");
        }
    }
}

TEST(ModelShifts, ASizeThatIsOffIsDepthThatIsOffByTheSameShare) {
    const Eigen::Vector3d sight_mm(30, -40, 1000);
    const ModelShift shift = size_shift(sight_mm);
    // Larger by 0.2 % at one place looks like the same at 0.2 % less: the pixels of a point off the centre agree.
    const Eigen::Vector3d off_mm(20, 10, 0), larger_mm = sight_mm + 1.002 * off_mm;
    const Eigen::Vector3d nearer_mm = sight_mm - shift.twist.tail<3>() + off_mm;
    EXPECT_LT((larger_mm / larger_mm.z() - nearer_mm / nearer_mm.z()).norm(), 1e-6);
    EXPECT_EQ(shift.twist.head<3>(), Eigen::Vector3d::Zero());
    Confidence confidence{.is_estimated = true};
    add_model_error(confidence, {&shift, 1}, 30);
    split_by_depth(confidence, sight_mm.normalized());
    EXPECT_NEAR(confidence.in_depth_mm, kModelCalibration * 0.002 * sight_mm.norm(), 1e-9);
    EXPECT_NEAR(confidence.in_plane_mm, 0, 1e-5);
}

TEST(PoseSums, InformationIsWhatCorrelatesAndWhatRobustWeightsLeave) {
    const JackknifeCase exact, noisy(0.5);
    EXPECT_NEAR(exact.sums()[0].information, 1, 1e-5);
    const double correlation = 1 - noisy.sums()[0].all.cost;
    ASSERT_LT(correlation, 0.8);
    EXPECT_DOUBLE_EQ(noisy.sums()[0].information, correlation);
    // Weights that fall to w leave 4 sqrt(w) - 3 of it.
    const Image robust(48, 48, 0.81F);
    const auto sums = pose_sums(
        *noisy.session, noisy.truth, noisy.extent.centre_ct_mm, [] {}, {}, std::vector<Image>{robust, robust});
    EXPECT_NEAR(sums[0].information, 0.6 * correlation, 1e-6);
    const Image rejected(48, 48, 0.25F);
    EXPECT_EQ(pose_sums(
                  *noisy.session, noisy.truth, noisy.extent.centre_ct_mm, [] {}, {},
                  std::vector<Image>{rejected, rejected})[1]
                  .information,
              0);
}

TEST(Jackknife, StepsAsFarAsTheInformationSays) {
    const JackknifeCase c(0.01);
    std::vector<ViewSums> sums = c.sums();
    const std::vector<double> shares{0.5, 0.5};
    for (ViewSums& view : sums) view.information = 0.25;
    const Confidence plain = jackknife(sums, shares, c.extent.radius_mm, 1),
                     informed = jackknife(sums, shares, c.extent.radius_mm, 1, true);
    EXPECT_NEAR(informed.rim_mm / plain.rim_mm, 4, 1e-6);
    for (ViewSums& view : sums) view.information = 0;
    EXPECT_GT(jackknife(sums, shares, c.extent.radius_mm, 1, true).rim_mm, 40 * plain.rim_mm) << "and finite";
}

TEST(PoseSums, RenderOnceAndLinearizeNever) {
    const JackknifeCase c(0.01);
    int views = 0;
    const auto before = c.session->counters().linearizations;
    (void)c.sums([&] { ++views; });
    EXPECT_EQ(views, 2);
    EXPECT_EQ(c.session->counters().linearizations, before);
}

TEST(PoseSums, LeaveTheWeightsAsTheyWereAlsoWhereStopped) {
    struct Stop {};  // like the driver's own, no Error
    const JackknifeCase c(0.01);
    c.weigh_unevenly();
    const auto before = c.weights();
    (void)c.sums();
    EXPECT_EQ(c.weights(), before);
    EXPECT_THROW((void)c.sums([] { throw Stop{}; }), Stop);
    EXPECT_EQ(c.weights(), before);
}

TEST(PoseSums, AreTheSameBitsAtAnyNumberOfThreads) {
    JackknifeCase c(0.01);
    const Confidence two = c.jackknifed(1);
    BackendOptions options;
    options.cpu.threads = 1;
    c.backend = create_backend("cpu", options).backend;
    c.make_session();
    EXPECT_EQ(c.jackknifed(1).covariance, two.covariance);
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
    const Confidence found = c.jackknifed(1);
    EXPECT_FALSE(found.is_estimated);
    EXPECT_EQ(found.rim_mm, 0);
    EXPECT_EQ(c.weights(), before);
}

}  // namespace
}  // namespace raylign::detail

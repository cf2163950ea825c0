#include "core/registration/trust/magnification.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/registration/trust/pose_sums.h"
#include "raylign/backends.h"
#include "raylign/registration.h"
#include "raylign/targets.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

constexpr double kShare[] = {0.5, 0.5};

void magnify(std::vector<View>& views, double by) {
    for (View& view : views) view.geometry.camera.intrinsics_px.topLeftCorner<2, 2>() *= by;
}

/// The spine phantom's voxels in exact X-rays of it.
struct MagnifiedCase {
    Volume volume = test::spine_volume(64);
    RigidTransform truth = test::oblique_pose();
    std::vector<View> views =
        test::with_exact_images(test::biplane_views(96), spine_phantom({160, 160, 160}), truth, 1e5);
    std::unique_ptr<Backend> backend = create_backend("cpu").backend;

    /// Nothing is left to explain where the cameras are right.
    void take_own_drrs() {
        const auto session = backend->prepare({volume, views, {}, {}});
        for (std::size_t v = 0; v < views.size(); ++v) views[v].image = session->render(truth, v);
    }
    [[nodiscard]] std::vector<ViewSums> sums() const {
        const auto session = backend->prepare({volume, views, {}, {Metric::gc, {3, 8}}});
        return pose_sums(
            *session, truth, volume.grid.centre_ct_mm(), [] {}, by_magnification(views));
    }
};

TEST(Magnification, DerivativeIsTheLimitOfLongerAndShorterCameras) {
    MagnifiedCase c;
    const auto drr = [&](double magnification) {
        std::vector<View> views = c.views;
        magnify(views, magnification);
        return c.backend->prepare({c.volume, views, {}, {}})->render(c.truth, 1);
    };
    constexpr double kStep = 0.01;
    const Image longer = drr(1 + kStep), shorter = drr(1 - kStep);
    const Image derivative = magnification_derivative(drr(1), c.views[1].geometry.camera);
    double apart = 0, size = 0;
    for (std::size_t p = 0; p < derivative.pixels.size(); ++p) {
        const double difference = (longer.pixels[p] - shorter.pixels[p]) / (2 * kStep);
        apart += std::pow(difference - derivative.pixels[p], 2);
        size += std::pow(difference, 2);
    }
    // Central differences of pixels smooth what a change of the camera leaves sharp: 12 % here, 100 % for a wrong sign
    // or centre.
    EXPECT_LT(std::sqrt(apart / size), 0.2);
}

TEST(Magnification, AColumnThatIsADerivativeOfThePoseIsLinearizedAlike) {
    std::vector<JacobianSums> channels(2);
    std::vector<ColumnSums> columns(2);
    constexpr int kColumn = 2;
    for (int c = 0; c < 2; ++c) {
        Image fixed(9, 7, 0), moving(9, 7, 0), weights(9, 7, 1);
        std::array<Image, 6> jacobian;
        for (Image& image : jacobian) image = Image(9, 7, 0);
        for (int p = 0; p < 63; ++p) {
            fixed.pixels[p] = static_cast<float>(std::sin(p + c));
            moving.pixels[p] = static_cast<float>(std::sin(p + 0.3 + c));
            for (int i = 0; i < 6; ++i) jacobian[i].pixels[p] = static_cast<float>(std::cos((i + 1) * 0.7 * p + c));
            const double column = jacobian[kColumn].pixels[p];
            columns[c].sum += column;
            columns[c].fixed += column * fixed.pixels[p];
            columns[c].moving += column * moving.pixels[p];
            columns[c].squared += column * column;
            for (int i = 0; i < 6; ++i) columns[c].jacobian[i] += column * jacobian[i].pixels[p];
        }
        channels[c] = jacobian_sums(fixed, moving, jacobian, weights);
    }
    const Linearization pose = linearize_view(channels);
    const ScaledLinearization scaled = linearize_scaled(channels, columns);
    EXPECT_LT((scaled.gradient.head<6>() - pose.gradient).norm(), 1e-12);
    EXPECT_NEAR(scaled.gradient[6], pose.gradient[kColumn], 1e-12);
    for (int i = 0; i < 6; ++i) {
        EXPECT_NEAR(scaled.curvature(i, 6), pose.curvature(i, kColumn), 1e-9) << i;
        EXPECT_EQ(scaled.curvature(6, i), scaled.curvature(i, 6)) << i;
    }
    EXPECT_NEAR(scaled.curvature(6, 6), pose.curvature(kColumn, kColumn), 1e-9);
}

TEST(Magnification, IsFoundWithItsSignAndNoneWhereCamerasAreRight) {
    MagnifiedCase c;
    c.take_own_drrs();
    const auto right = magnification(c.sums(), kShare, 1);
    ASSERT_TRUE(right);
    EXPECT_LT(std::abs(right->log), 1e-6);
    EXPECT_FALSE(magnification_doubt(right));
    for (const double by : {0.985, 1.015}) {
        MagnifiedCase wrong;
        wrong.take_own_drrs();
        magnify(wrong.views, by);
        const auto found = magnification(wrong.sums(), kShare, 1);
        ASSERT_TRUE(found);
        EXPECT_NEAR(found->log, -std::log(by), 0.0015) << "one step, of which the pixels' differences take a part";
        EXPECT_TRUE(magnification_doubt(found)) << by;
    }
}

TEST(Magnification, IsNotAskedOfOneViewOrWithoutCameras) {
    const MagnifiedCase c;
    const std::vector<ViewSums> both = c.sums();
    EXPECT_FALSE(magnification({both.data(), 1}, kShare, 1)) << "depth explains it as well";
    const auto session = c.backend->prepare({c.volume, c.views, {}, {Metric::gc, {3, 8}}});
    EXPECT_FALSE(magnification(pose_sums(*session, c.truth, c.volume.grid.centre_ct_mm(), [] {}), kShare, 1));
}

class WrongScale : public testing::TestWithParam<double> {};

TEST_P(WrongScale, IsWhatTheRegistrationIsDoubtedFor) {
    MagnifiedCase c;
    magnify(c.views, GetParam());
    const auto targets = default_targets_ct_mm(c.volume);
    const RegistrationResult result =
        register_volume(c.volume, c.views, perturbed_start(c.truth, targets, 4, 1), {}, *c.backend);
    EXPECT_FALSE(result.ok);
    ASSERT_FALSE(result.reasons.empty());
    const std::string magnified = "all views fit best if magnified by ";
    ASSERT_TRUE(result.reasons.front().starts_with(magnified)) << result.reasons.front();
    EXPECT_NEAR(std::stod(result.reasons.front().substr(magnified.size())), 1 / GetParam(), 0.03);
    EXPECT_TRUE(result.confidence.is_withheld);
}
// One step from the result sees the small one; the others are looked for.
INSTANTIATE_TEST_SUITE_P(Factors, WrongScale, testing::Values(0.9, 1.03, 1.1));

}  // namespace
}  // namespace raylign::detail

// Parity ladder, step 7: analytic derivatives against central differences of the same backend's cost, in double.

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include <array>
#include <cmath>
#include <tuple>

#include "core/similarity/linearization.h"
#include "tests/support/backends.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

constexpr double kUnitRadius_mm = 60;  // makes rotations and translations comparable: the spine's half width

struct Case {
    std::string name;
    Metric metric;
    Projector projector;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class Derivatives : public testing::TestWithParam<std::tuple<std::string, Case>> {
protected:
    void SetUp() override {
        const auto& [backend_name, c] = GetParam();
        RAYLIGN_MAKE_BACKEND(backend, backend_name);
        if (!backend->info().has_derivatives) GTEST_SKIP() << backend_name << " has none, and says so";
        views_ = test::with_exact_images(test::biplane_views(40), spine_phantom({160, 160, 160}), test::oblique_pose());
        views_[0].weights = Image(40, 40, 1);
        for (int y = 0; y < 12; ++y) {
            for (int x = 0; x < 9; ++x) views_[0].weights(x, y) = 0;  // a corner masked out
        }
        for (int y = 12; y < 40; ++y) views_[0].weights(30, y) = 0.5F;
        session_ = backend->prepare({volume_, views_, {c.projector, {}}, {c.metric, {1.5, 4}}});
    }

    double cost(const Twist& scaled) {
        Twist twist = scaled;
        twist.head<3>() /= kUnitRadius_mm;
        const RigidTransform pose = exp_about(twist, start_ * centre_ct_mm_) * start_;
        double value = 0;
        session_->evaluate({&pose, 1}, {&value, 1});
        return value;
    }

    Linearization linearize() {
        Linearization result;
        session_->linearize({&start_, 1}, centre_ct_mm_, {&result, 1});
        return result;
    }

    Volume volume_ = test::spine_volume(32);
    std::vector<View> views_;
    Eigen::Vector3d centre_ct_mm_{3, -5, 8};
    RigidTransform start_ = exp((Twist() << 0.02, 0.03, -0.01, 1.5, 2, -1).finished()) * test::oblique_pose();
    std::unique_ptr<Session> session_;
};

TEST(NoDerivatives, AreAnErrorThatSaysWhatToUse) {
    const Volume volume = test::spine_volume(16);
    const auto views =
        test::with_exact_images(test::biplane_views(24), spine_phantom({160, 160, 160}), test::oblique_pose());
    for (const BackendStatus& status : backend_statuses()) {
        if (!status.available || status.info.has_derivatives) continue;
        const auto session = create_backend(status.name).backend->prepare({volume, views, {}, {Metric::gc, {1.5, 4}}});
        const RigidTransform pose = test::oblique_pose();
        Linearization result;
        try {
            session->linearize({&pose, 1}, {0, 0, 0}, {&result, 1});
            FAIL() << "must throw";
        } catch (const Error& error) {
            EXPECT_NE(std::string(error.what()).find("steepest-descent"), std::string::npos) << error.what();
        }
        EXPECT_THROW((void)session->render_with_derivatives(pose, {0, 0, 0}, 0), Error);
    }
}

TEST_P(Derivatives, GradientIsTheLimitOfCentralDifferences) {
    Twist analytic = linearize().gradient;
    analytic.head<3>() /= kUnitRadius_mm;
    // Interpolation has kinks at voxel borders, so the error of differences falls more slowly than h^2; float images of
    // size 1 add 1e-7 / h. Between those two, at h = 0.01 mm, a percent of the gradient is left.
    Twist differences;
    const double h = 0.01;
    for (int i = 0; i < 6; ++i) {
        const Twist step = h * Twist::Unit(i);
        differences[i] = (cost(step) - cost(-step)) / (2 * h);
    }
    EXPECT_LT((analytic - differences).norm(), 0.01 * differences.norm())
        << "analytic " << analytic.transpose() << "\ndifferences " << differences.transpose();
}

TEST_P(Derivatives, DifferencesApproachTheGradientAsTheStepShrinks) {
    Twist analytic = linearize().gradient;
    analytic.head<3>() /= kUnitRadius_mm;
    double last = 1e300;
    for (const double h : {4.0, 1.0, 0.25}) {
        Twist differences;
        for (int i = 0; i < 6; ++i) {
            const Twist step = h * Twist::Unit(i);
            differences[i] = (cost(step) - cost(-step)) / (2 * h);
        }
        const double error = (analytic - differences).norm() / analytic.norm();
        EXPECT_LT(error, last / 2) << "h = " << h;  // second order would give 16, kinks take most of it
        last = error;
    }
}

TEST_P(Derivatives, ImagesAreThoseThatTheSumsAreMadeOf) {
    // Summed in core from the images that come out, with the weights that the session uses: what linearize_views gives.
    std::vector<Linearization> at(2);
    session_->linearize_views({&start_, 1}, centre_ct_mm_, at);
    for (std::size_t v = 0; v < 2; ++v) {
        const DrrWithDerivatives rendered = session_->render_with_derivatives(start_, centre_ct_mm_, v);
        std::array<std::vector<Image>, 6> derivatives;
        for (int i = 0; i < 6; ++i) derivatives[i] = session_->channels_of(rendered.derivatives[i]);
        const std::vector<Image> moving = session_->channels_of(rendered.drr);
        const FixedChannels& fixed = session_->fixed_channels(v);
        std::vector<JacobianSums> sums;
        for (std::size_t c = 0; c < moving.size(); ++c) {
            std::array<Image, 6> jacobian;
            for (int i = 0; i < 6; ++i) jacobian[i] = derivatives[i][c];
            sums.push_back(jacobian_sums(fixed.channels[c], moving[c], jacobian, fixed.weights));
        }
        const Linearization summed = linearize_view(sums);
        constexpr double kFloatSums = 2e-5;  // relative
        EXPECT_NEAR(summed.cost, at[v].cost, kFloatSums);
        EXPECT_LT((summed.gradient - at[v].gradient).norm(), kFloatSums * std::sqrt(at[v].curvature.norm()));
        EXPECT_LT((summed.curvature - at[v].curvature).norm(), kFloatSums * at[v].curvature.norm());
    }
}

TEST_P(Derivatives, OfImagesAreThoseOfReference) {
    RAYLIGN_MAKE_BACKEND(backend, "reference");
    const Case& c = std::get<1>(GetParam());
    const auto oracle = backend->prepare({volume_, views_, {c.projector, {}}, {c.metric, {1.5, 4}}});
    // Float rays leave a voxel's edge on the other side here and there, where a derivative jumps; the texture units of
    // GPUs round fractions to 1/256 of a voxel.
    constexpr double kOfTheLargest = 4e-3;
    for (std::size_t v = 0; v < 2; ++v) {
        const DrrWithDerivatives found = session_->render_with_derivatives(start_, centre_ct_mm_, v);
        const DrrWithDerivatives truth = oracle->render_with_derivatives(start_, centre_ct_mm_, v);
        EXPECT_EQ(truth.drr.pixels, oracle->render(start_, v).pixels);
        for (int i = 0; i < 6; ++i) {
            double square = 0, most = 0;
            for (std::size_t p = 0; p < truth.drr.pixels.size(); ++p) {
                const double expected = truth.derivatives[i].pixels[p];
                square += std::pow(found.derivatives[i].pixels[p] - expected, 2);
                most = std::max(most, std::abs(expected));
            }
            const double rms = std::sqrt(square / static_cast<double>(truth.drr.pixels.size()));
            EXPECT_GT(most, 0);
            EXPECT_LT(rms, kOfTheLargest * most) << "parameter " << i << " of view " << v;
        }
    }
}

TEST_P(Derivatives, OfImagesRefuseWhatRenderRefuses) {
    EXPECT_THROW((void)session_->render_with_derivatives(start_, centre_ct_mm_, 2), Error);
    EXPECT_THROW((void)session_->render_with_derivatives(start_, Eigen::Vector3d::Constant(NAN), 0), Error);
    RigidTransform nowhere = start_;
    nowhere.translation_mm.x() = NAN;
    EXPECT_THROW((void)session_->render_with_derivatives(nowhere, centre_ct_mm_, 0), Error);
}

TEST_P(Derivatives, CostIsTheCostOfEvaluate) { EXPECT_NEAR(linearize().cost, cost(Twist::Zero()), 1e-6); }

TEST_P(Derivatives, CurvatureIsSymmetricAndPositive) {
    const Linearization at = linearize();
    EXPECT_TRUE(at.curvature.isApprox(at.curvature.transpose(), 1e-12));
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> solver(at.curvature);
    EXPECT_GT(solver.eigenvalues().minCoeff(), 0);
}

INSTANTIATE_TEST_SUITE_P(All, Derivatives,
                         testing::Combine(testing::ValuesIn(backend_names()),
                                          testing::Values(Case{"GcJoseph", Metric::gc, Projector::joseph},
                                                          Case{"NccJoseph", Metric::ncc, Projector::joseph},
                                                          Case{"GcTrilinear", Metric::gc, Projector::trilinear})),
                         [](const auto& test) {
                             return test::test_name(std::get<0>(test.param)) + std::get<1>(test.param).name;
                         });

}  // namespace
}  // namespace raylign::detail

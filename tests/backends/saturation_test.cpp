// Detectors that saturate: every backend shows of a line integral I, before the filter, -log(f + (1 - f) exp(-I)) with
// f = exp(-ceiling), and derivatives of that.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/backends.h"
#include "tests/support/errors.h"
#include "tests/support/scenes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail {
namespace {

class SaturatedDetector : public testing::TestWithParam<std::string> {
protected:
    void SetUp() override {
        RAYLIGN_MAKE_BACKEND(backend, GetParam());
        if (!backend->info().has_derivatives) GTEST_SKIP() << GetParam() << " has no model of saturation, and says so";
        backend_ = std::move(backend);
        views_ = test::with_exact_images(test::biplane_views(40), spine_phantom({160, 160, 160}), test::oblique_pose());
        open_ = views_;
        const auto session = prepare(*backend_);
        for (std::size_t v = 0; v < views_.size(); ++v) {
            std::vector<float> sorted = session->render(start_, v).pixels;
            std::ranges::sort(sorted);
            views_[v].ceiling = sorted[sorted.size() * 8 / 10];  // a fifth of the image is denser
        }
    }

    [[nodiscard]] std::unique_ptr<Session> prepare(Backend& backend) const {
        return backend.prepare({volume_, views_, {}, {Metric::gc, {1.5, 4}}});
    }

    Volume volume_ = test::spine_volume(32);
    std::vector<View> views_, open_;
    Eigen::Vector3d centre_ct_mm_{3, -5, 8};
    RigidTransform start_ = exp((Twist() << 0.02, 0.03, -0.01, 1.5, 2, -1).finished()) * test::oblique_pose();
    std::unique_ptr<Backend> backend_;
};

TEST_P(SaturatedDetector, DrrShowsThatALeastShareGetsThrough) {
    constexpr double kRounding = 1e-5;  // exp and log of floats up to 10, on a GPU by 23 units in the last place
    const auto session = prepare(*backend_);
    const auto open = backend_->prepare({volume_, open_, {}, {Metric::gc, {1.5, 4}}});
    for (std::size_t v = 0; v < views_.size(); ++v) {
        const Image shown = session->render(start_, v), whole = open->render(start_, v);
        const double share = std::exp(-views_[v].ceiling);
        std::size_t dense = 0;
        for (std::size_t i = 0; i < shown.pixels.size(); ++i) {
            const double right = -std::log(share + (1 - share) * std::exp(-double{whole.pixels[i]}));
            ASSERT_NEAR(shown.pixels[i], right, kRounding) << i;
            ASSERT_LE(shown.pixels[i], views_[v].ceiling + kRounding) << i;
            ASSERT_TRUE(whole.pixels[i] != 0 || shown.pixels[i] == 0) << i;
            dense += whole.pixels[i] > views_[v].ceiling ? 1 : 0;
        }
        EXPECT_GT(dense, shown.pixels.size() / 6);
        EXPECT_LT(dense, shown.pixels.size() / 3);
    }
}

TEST_P(SaturatedDetector, CostIsTheReferences) {
    const auto session = prepare(*backend_);
    const auto reference = create_backend("reference").backend;
    const auto oracle = prepare(*reference);
    double cost = 0, right = 0, open_cost = 0;
    session->evaluate({&start_, 1}, {&cost, 1});
    oracle->evaluate({&start_, 1}, {&right, 1});
    backend_->prepare({volume_, open_, {}, {Metric::gc, {1.5, 4}}})->evaluate({&start_, 1}, {&open_cost, 1});
    EXPECT_NEAR(cost, right, 1e-4);
    EXPECT_GT(std::abs(cost - open_cost), 1e-3) << "the ceiling matters, ten times what backends differ by";
}

TEST_P(SaturatedDetector, GradientIsTheLimitOfCentralDifferences) {
    const auto session = prepare(*backend_);
    Linearization at;
    session->linearize({&start_, 1}, centre_ct_mm_, {&at, 1});
    constexpr double kRadius_mm = 60, kStep = 0.01;  // as derivatives_test.cpp, where the reason is
    const auto cost = [&](Twist twist) {
        twist.head<3>() /= kRadius_mm;
        const RigidTransform pose = exp_about(twist, start_ * centre_ct_mm_) * start_;
        double value = 0;
        session->evaluate({&pose, 1}, {&value, 1});
        return value;
    };
    Twist analytic = at.gradient, differences;
    analytic.head<3>() /= kRadius_mm;
    for (int i = 0; i < 6; ++i) {
        differences[i] = (cost(kStep * Twist::Unit(i)) - cost(-kStep * Twist::Unit(i))) / (2 * kStep);
    }
    EXPECT_LT((analytic - differences).norm(), 0.02 * differences.norm())
        << "analytic " << analytic.transpose() << "\ndifferences " << differences.transpose();
    EXPECT_NEAR(at.cost, cost(Twist::Zero()), 1e-6);
}

TEST_P(SaturatedDetector, ACeilingAboveTheDrrChangesNothing) {
    double open_cost = 0, cost = 0;
    backend_->prepare({volume_, open_, {}, {Metric::gc, {1.5, 4}}})->evaluate({&start_, 1}, {&open_cost, 1});
    for (View& view : views_) view.ceiling = 1000;
    prepare(*backend_)->evaluate({&start_, 1}, {&cost, 1});
    EXPECT_EQ(cost, open_cost);
}

TEST_P(SaturatedDetector, ABadCeilingIsNamed) {
    for (const double ceiling : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
        views_[1].ceiling = ceiling;
        const std::string message = test::error_of([&] { (void)prepare(*backend_); });
        EXPECT_NE(message.find("ceiling"), std::string::npos) << message;
    }
}

INSTANTIATE_TEST_SUITE_P(All, SaturatedDetector, testing::ValuesIn(backend_names()),
                         [](const auto& test) { return test::test_name(test.param); });

}  // namespace
}  // namespace raylign::detail

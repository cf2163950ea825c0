// New pixel weights (Session::set_weights): the same sums on every backend, and nothing but the weights changes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "core/base/random.h"
#include "tests/support/backends.h"
#include "tests/support/errors.h"
#include "tests/support/scenes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail {
namespace {

constexpr int kSide = 45;  // no multiple of a vector or a tile
constexpr int kMaskedRows = 12;

class BackendWeights : public testing::TestWithParam<std::string> {
protected:
    void SetUp() override {
        RAYLIGN_MAKE_BACKEND(made, GetParam());
        backend_ = std::move(made);
        views_[0].weights = Image(kSide, kSide, 1);
        for (int i = 0; i < kMaskedRows * kSide; ++i) {
            views_[0].weights.pixels[i] = 0;
            views_[0].image.pixels[i] = std::numeric_limits<float>::quiet_NaN();
        }
    }
    [[nodiscard]] Scene scene(Metric metric, Projector projector = Projector::joseph) const {
        return {volume_, views_, {projector, {}}, {metric, {1.5, 4}}};
    }
    /// In [0, 1], a fifth of them 0, different in each view.
    [[nodiscard]] std::vector<Image> some_weights(unsigned seed) const {
        Random random(seed);
        std::vector<Image> weights(views_.size(), Image(kSide, kSide));
        for (Image& image : weights) {
            for (float& w : image.pixels) w = static_cast<float>(std::max(0.0, random.uniform(-0.25, 1)));
        }
        return weights;
    }
    [[nodiscard]] std::vector<Image> all_ones() const { return {views_.size(), Image(kSide, kSide, 1)}; }
    [[nodiscard]] std::vector<double> costs(Session& session) const {
        std::vector<double> result(poses_.size());
        session.evaluate(poses_, result);
        return result;
    }

    std::unique_ptr<Backend> backend_;
    Volume volume_ = test::spine_volume(24);
    std::vector<RigidTransform> poses_ = {
        test::oblique_pose(), exp((Twist() << 0.02, -0.03, 0.05, 2, 1, -3).finished()) * test::oblique_pose()};
    std::vector<View> views_ =
        test::with_exact_images(test::biplane_views(kSide), spine_phantom({160, 160, 160}), test::oblique_pose());
};

TEST_P(BackendWeights, SumsAndCostsAreThoseOfTheReference) {
    for (const Metric metric : {Metric::gc, Metric::ncc}) {
        const auto ours = backend_->prepare(scene(metric));
        const auto oracle = create_backend("reference").backend->prepare(scene(metric));
        const std::vector<double> before = costs(*ours);
        for (const unsigned seed : {1, 2}) {
            const std::vector<Image> weights = some_weights(seed);
            ours->set_weights(weights);
            oracle->set_weights(weights);
            const auto a = ours->moment_sums(poses_), b = oracle->moment_sums(poses_);
            for (std::size_t i = 0; i < a.size(); ++i) {
                EXPECT_EQ(a[i].weight, b[i].weight);
                EXPECT_NEAR(a[i].fixed, b[i].fixed, 1e-6 * std::sqrt(b[i].weight * b[i].fixed_fixed));
                EXPECT_NEAR(a[i].fixed_fixed, b[i].fixed_fixed, 1e-6 * b[i].fixed_fixed);
                EXPECT_NEAR(a[i].moving_moving, b[i].moving_moving, 2 * test::kFloatImageShare * b[i].moving_moving);
                EXPECT_NEAR(a[i].fixed_moving, b[i].fixed_moving, 2 * test::kFloatImageShare * b[i].moving_moving);
            }
            const std::vector<double> found = costs(*ours), truth = costs(*oracle);
            for (std::size_t i = 0; i < found.size(); ++i) {
                EXPECT_NEAR(found[i], truth[i], test::kCost);
                EXPECT_GT(std::abs(found[i] - before[i]), 10 * test::kCost) << "weights that change nothing";
            }
        }
    }
}

TEST_P(BackendWeights, LinearizationsAreThoseOfTheReference) {
    if (!backend_->info().has_derivatives) GTEST_SKIP() << GetParam() << " has no derivatives";
    for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
        const auto ours = backend_->prepare(scene(Metric::gc, projector));
        const auto oracle = create_backend("reference").backend->prepare(scene(Metric::gc, projector));
        ours->set_weights(some_weights(3));
        oracle->set_weights(some_weights(3));
        std::vector<Linearization> found(poses_.size()), truth(poses_.size());
        ours->linearize(poses_, {3, -5, 8}, found);
        oracle->linearize(poses_, {3, -5, 8}, truth);
        for (std::size_t i = 0; i < found.size(); ++i) {
            // Derivative images are differences of neighbouring voxels: float errors weigh more than in the image.
            EXPECT_NEAR(found[i].cost, truth[i].cost, test::kCost);
            EXPECT_LT((found[i].gradient - truth[i].gradient).norm(), 1e-3 * truth[i].gradient.norm());
            EXPECT_LT((found[i].curvature - truth[i].curvature).norm(), 1e-3 * truth[i].curvature.norm());
        }
    }
}

TEST_P(BackendWeights, MaskedPixelsStayOut) {
    const auto session = backend_->prepare(scene(Metric::gc));
    const std::vector<double> masked = costs(*session);
    for (const double cost : masked) EXPECT_TRUE(std::isfinite(cost));
    session->set_weights(all_ones());
    EXPECT_EQ(costs(*session), masked);
    for (int i = 0; i < kMaskedRows * kSide; ++i) EXPECT_EQ(session->fixed_channels(0).weights.pixels[i], 0);
}

TEST_P(BackendWeights, OnlyTheLastWeightsCount) {
    const auto session = backend_->prepare(scene(Metric::gc)), other = backend_->prepare(scene(Metric::gc));
    const std::vector<double> before = costs(*session);
    session->set_weights(some_weights(4));
    session->set_weights(some_weights(5));
    other->set_weights(some_weights(5));
    EXPECT_EQ(costs(*session), costs(*other));
    session->set_weights(all_ones());
    EXPECT_EQ(costs(*session), before);
}

TEST_P(BackendWeights, PixelsThatHadNoWeightAreCastAgainWhereTheyGetSome) {
    const auto session = backend_->prepare(scene(Metric::ncc));
    const std::vector<double> before = costs(*session);
    std::vector<Image> corner = all_ones();
    for (Image& image : corner) {
        for (int y = 0; y < kSide; ++y) {
            for (int x = 20; x < kSide; ++x) image(x, y) = 0;
        }
    }
    session->set_weights(corner);
    EXPECT_NE(costs(*session), before);
    session->set_weights(all_ones());
    EXPECT_EQ(costs(*session), before);
}

TEST_P(BackendWeights, BadWeightsAreRefusedAndLeaveTheOldOnes) {
    const auto session = backend_->prepare(scene(Metric::gc));
    session->set_weights(some_weights(6));
    const std::vector<double> before = costs(*session);
    const auto refuses = [&](const std::function<void(std::vector<Image>&)>& spoil, const std::string& message) {
        std::vector<Image> weights = all_ones();
        spoil(weights);
        EXPECT_THAT(test::error_of([&] { session->set_weights(weights); }), testing::HasSubstr(message));
        EXPECT_EQ(costs(*session), before) << message;
    };
    constexpr float kNanWeight = std::numeric_limits<float>::quiet_NaN();
    constexpr float kInfWeight = std::numeric_limits<float>::infinity();
    refuses([](auto& w) { w.pop_back(); }, "number of weight images = 1");
    refuses([](auto& w) { w.push_back(w[0]); }, "number of weight images = 3");
    refuses([](auto& w) { w[1] = Image(kSide, kSide - 1, 1); }, "45 x 44");
    refuses([](auto& w) { w[1] = {}; }, "0 x 0");
    refuses([&](auto& w) { w[1](3, 4) = kNanWeight; }, "view 1");
    refuses([&](auto& w) { w[0](3, 40) = kInfWeight; }, "finite and not negative");
    refuses([](auto& w) { w[1](44, 44) = -1e-6F; }, "finite and not negative");
    refuses([](auto& w) { std::ranges::fill(w[1].pixels, 0.F); }, "pixels with weight = 0");
    refuses(
        [](auto& w) {  // enough pixels, but all of them masked
            for (int i = kMaskedRows * kSide; i < kSide * kSide; ++i) w[0].pixels[i] = 0;
        },
        "pixels with weight = 0");
}

TEST_P(BackendWeights, ViewsWithoutImagesHaveNone) {
    views_[1].image = {};
    const auto session = backend_->prepare(scene(Metric::gc));
    EXPECT_THROW(session->set_weights(all_ones()), Error);
    EXPECT_THROW((void)session->fixed_channels(0), Error);
}

INSTANTIATE_TEST_SUITE_P(All, BackendWeights, testing::ValuesIn(backend_names()),
                         [](const auto& test) { return test::test_name(test.param); });

}  // namespace
}  // namespace raylign::detail

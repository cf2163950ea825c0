// What each view alone says: the parts of every backend's linearizations.

#include <gtest/gtest.h>

#include "tests/support/backends.h"
#include "tests/support/scenes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail {
namespace {

const Eigen::Vector3d kPerViewCentre_ct_mm(3, -5, 8);

class PerView : public testing::TestWithParam<std::string> {
protected:
    void SetUp() override {
        RAYLIGN_MAKE_BACKEND(backend, GetParam());
        if (!backend->info().has_derivatives) GTEST_SKIP() << GetParam() << " has none, and says so";
        backend_ = std::move(backend);
        views_ = test::with_exact_images({{"AP", test::c_arm_view(0, 40), {}, {}},
                                          {"LAT", test::c_arm_view(90, 40), {}, {}},
                                          {"LAO", test::c_arm_view(35, 32), {}, {}}},
                                         spine_phantom({160, 160, 160}), test::oblique_pose());
        views_[1].cost_weight = 3;
        views_[2].weights = Image(32, 32, 1);
        for (int x = 0; x < 32; ++x) views_[2].weights(x, 5) = 0;
    }
    [[nodiscard]] Scene scene() const { return {volume_, views_, {}, {Metric::gc, {1.5, 4}}}; }
    [[nodiscard]] std::vector<Linearization> of_views(Session& session) const {
        std::vector<Linearization> at(poses_.size() * session.view_count());
        session.linearize_views(poses_, kPerViewCentre_ct_mm, at);
        return at;
    }

    std::unique_ptr<Backend> backend_;
    Volume volume_ = test::spine_volume(32);
    std::vector<View> views_;
    std::vector<RigidTransform> poses_{
        test::oblique_pose(), exp((Twist() << 0.02, 0.03, -0.01, 1.5, 2, -1).finished()) * test::oblique_pose()};
};

TEST_P(PerView, SumsToTheWholeBitForBit) {
    const auto session = backend_->prepare(scene());
    std::vector<Linearization> whole(poses_.size());
    session->linearize(poses_, kPerViewCentre_ct_mm, whole);
    const std::vector<Linearization> parts = of_views(*session);
    for (std::size_t pose = 0; pose < poses_.size(); ++pose) {
        Linearization sum;
        for (std::size_t v = 0; v < 3; ++v) {
            const Linearization& part = parts[3 * pose + v];
            const double share = session->view_share(v);
            sum += {share * part.cost, share * part.gradient, share * part.curvature};
        }
        EXPECT_EQ(sum.cost, whole[pose].cost);
        EXPECT_EQ(sum.gradient, whole[pose].gradient);
        EXPECT_EQ(sum.curvature, whole[pose].curvature);
    }
}

TEST_P(PerView, SharesAreThoseOfTheWeights) {
    const auto session = backend_->prepare(scene());
    EXPECT_NEAR(session->view_share(0), 0.2, 1e-15);
    EXPECT_NEAR(session->view_share(1), 0.6, 1e-15);
    EXPECT_NEAR(session->view_share(2), 0.2, 1e-15);
}

TEST_P(PerView, AViewAmongOthersSaysWhatItSaysAlone) {
    const auto session = backend_->prepare(scene());
    const std::vector<Linearization> parts = of_views(*session);
    for (std::size_t v = 0; v < 3; ++v) {
        const auto alone = session->with_views(std::span(views_).subspan(v, 1), {Metric::gc, {1.5, 4}});
        std::vector<Linearization> at(poses_.size());
        alone->linearize(poses_, kPerViewCentre_ct_mm, at);
        for (std::size_t pose = 0; pose < poses_.size(); ++pose) {
            const Linearization& part = parts[3 * pose + v];
            EXPECT_NEAR(part.cost, at[pose].cost, 1e-9);
            EXPECT_LT((part.gradient - at[pose].gradient).norm(), 1e-6 * at[pose].gradient.norm());
            EXPECT_LT((part.curvature - at[pose].curvature).norm(), 1e-6 * at[pose].curvature.norm());
        }
    }
}

TEST_P(PerView, PartsAreThoseOfTheReference) {
    const auto ours = backend_->prepare(scene());
    const auto oracle = create_backend("reference").backend->prepare(scene());
    const std::vector<Linearization> found = of_views(*ours), truth = of_views(*oracle);
    for (std::size_t i = 0; i < found.size(); ++i) {
        EXPECT_NEAR(found[i].cost, truth[i].cost, test::kCost);
        EXPECT_LT((found[i].gradient - truth[i].gradient).norm(), 1e-3 * truth[i].gradient.norm());
        EXPECT_LT((found[i].curvature - truth[i].curvature).norm(), 1e-3 * truth[i].curvature.norm());
    }
}

TEST_P(PerView, NeedsAPlaceForEachPoseAndView) {
    const auto session = backend_->prepare(scene());
    std::vector<Linearization> too_few(poses_.size());
    try {
        session->linearize_views(poses_, kPerViewCentre_ct_mm, too_few);
        FAIL() << "must throw";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("number of results = 2: must be 6"), std::string::npos)
            << error.what();
    }
}

INSTANTIATE_TEST_SUITE_P(All, PerView, testing::ValuesIn(backend_names()),
                         [](const auto& test) { return test::test_name(test.param); });

}  // namespace
}  // namespace raylign::detail

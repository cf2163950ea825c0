// Parity ladder, steps 2, 5 and 6: every backend against the reference, in one process, on one list of cases.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "raylign/registration.h"
#include "raylign/targets.h"
#include "tests/support/backends.h"
#include "tests/support/image_compare.h"
#include "tests/support/scenes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail {
namespace {

class BackendParity : public testing::TestWithParam<std::string> {
protected:
    void SetUp() override {
        RAYLIGN_MAKE_BACKEND(made, GetParam());
        backend_ = std::move(made);
    }
    [[nodiscard]] Scene scene(Projector projector = Projector::joseph, Metric metric = Metric::gc) const {
        return {volume_, views_, {projector, {}}, {metric, {2, 6}}};
    }

    std::unique_ptr<Backend> backend_;
    std::unique_ptr<Backend> reference_ = create_backend("reference").backend;
    Volume volume_ = test::spine_volume(32);
    RigidTransform truth_ = test::oblique_pose();
    std::vector<View> views_ =
        test::with_exact_images(test::biplane_views(48), spine_phantom({160, 160, 160}), truth_, 100000);
};

TEST_P(BackendParity, ImagesAgreeForAllPosesViewsAndProjectors) {
    for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
        const auto ours = backend_->prepare(scene(projector)), oracle = reference_->prepare(scene(projector));
        for (int i = 0; i < 6; ++i) {  // around the compass, so that every axis dominates once
            const RigidTransform pose = exp((Twist() << 0.5 * i, 0.9 * i, -0.4 * i, 3, -2, i).finished());
            for (std::size_t view = 0; view < 2; ++view) {
                EXPECT_TRUE(
                    test::images_near(ours->render(pose, view), oracle->render(pose, view), test::kFloatImageShare))
                    << projector_name(projector) << ", pose " << i << ", view " << view;
            }
        }
    }
}

TEST_P(BackendParity, SumsAndCostsAgree) {
    for (const Metric metric : {Metric::gc, Metric::ncc}) {
        const auto ours = backend_->prepare(scene(Projector::joseph, metric));
        const auto oracle = reference_->prepare(scene(Projector::joseph, metric));
        const RigidTransform pose = exp((Twist() << 0.02, -0.03, 0.05, 2, 1, -3).finished()) * truth_;
        const auto a = ours->moment_sums({&pose, 1}), b = oracle->moment_sums({&pose, 1});
        ASSERT_EQ(a.size(), b.size());
        for (std::size_t i = 0; i < a.size(); ++i) {
            EXPECT_EQ(a[i].weight, b[i].weight);
            EXPECT_NEAR(a[i].fixed_fixed, b[i].fixed_fixed, 1e-6 * b[i].fixed_fixed);
            EXPECT_NEAR(a[i].moving_moving, b[i].moving_moving, 2 * test::kFloatImageShare * b[i].moving_moving);
            EXPECT_NEAR(a[i].fixed_moving, b[i].fixed_moving, 2 * test::kFloatImageShare * b[i].moving_moving);
        }
        double cost_a = 0, cost_b = 0;
        ours->evaluate({&pose, 1}, {&cost_a, 1});
        oracle->evaluate({&pose, 1}, {&cost_b, 1});
        EXPECT_NEAR(cost_a, cost_b, test::kCost);
    }
}

/// Minimum of the cost along parameter `axis` by a parabola through the best of 41 samples, in mm or degrees.
double sweep_minimum(Session& session, const RigidTransform& centre_pose, int axis) {
    constexpr int kSamples = 41;
    const double step = axis < 3 ? 0.25 * std::numbers::pi / 180 : 0.25;
    std::vector<RigidTransform> poses;
    for (int i = 0; i < kSamples; ++i)
        poses.push_back(exp((i - kSamples / 2) * step * Twist::Unit(axis)) * centre_pose);
    std::vector<double> costs(poses.size());
    session.evaluate(poses, costs);
    const int k = static_cast<int>(std::ranges::min_element(costs) - costs.begin());
    if (k == 0 || k + 1 == kSamples) return 1e9;
    const double shift = 0.5 * (costs[k - 1] - costs[k + 1]) / (costs[k - 1] - 2 * costs[k] + costs[k + 1]);
    return (k - kSamples / 2 + shift) * 0.25;
}

TEST_P(BackendParity, SweepsOfEachParameterHaveTheirMinimumAtTheSamePlace) {
    const auto ours = backend_->prepare(scene()), oracle = reference_->prepare(scene());
    for (int axis = 0; axis < 6; ++axis) {
        const double a = sweep_minimum(*ours, truth_, axis), b = sweep_minimum(*oracle, truth_, axis);
        EXPECT_LT(std::abs(b), 1.0) << "axis " << axis << ": mm or degrees from the truth (a fifth of a 5 mm voxel)";
        const bool float_sums = GetParam() == "gl-2006";
        EXPECT_NEAR(a, b, float_sums ? test::kSweepMinimumOfFloatSums : test::kSweepMinimum) << "axis " << axis;
    }
}

TEST_P(BackendParity, RegistrationsFromOneStartEndAtOnePose) {
    const auto targets = default_targets_ct_mm(volume_);
    const RigidTransform start = perturbed_start(truth_, targets, 8, 11);
    const bool derivatives = backend_->info().has_derivatives;
    // Without robust weights, whose renewals would blur what is compared: the real CT's tests have them.
    const RegistrationOptions options{.method = derivatives ? Method::gauss_newton : Method::steepest_descent,
                                      .robust = false};
    const RegistrationResult ours = register_volume(volume_, views_, start, options, *backend_);
    const RegistrationResult oracle = register_volume(volume_, views_, start, options, *reference_);
    EXPECT_LT(mean_target_error_mm(ours.world_from_ct, truth_, targets), 2.5) << "half a voxel";
    EXPECT_LT(mean_target_error_mm(ours.world_from_ct, oracle.world_from_ct, targets),
              derivatives ? test::kCoarsePoseMtre_mm : test::kSteepestPoseMtre_mm);
    EXPECT_NEAR(ours.cost_final, oracle.cost_final, test::kCost);
}

std::vector<std::string> names_but_reference() {
    std::vector<std::string> names = backend_names();
    std::erase(names, "reference");
    return names;
}
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(BackendParity);  // a build with the reference only
INSTANTIATE_TEST_SUITE_P(All, BackendParity, testing::ValuesIn(names_but_reference()),
                         [](const auto& test) { return test::test_name(test.param); });

}  // namespace
}  // namespace raylign::detail

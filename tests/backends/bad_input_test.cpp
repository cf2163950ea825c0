// Bad input on every backend: a clear error before anything is allocated or cast, never a plausible number.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "tests/support/backends.h"
#include "tests/support/errors.h"
#include "tests/support/scenes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();

class BackendBadInput : public testing::TestWithParam<std::string> {
protected:
    void SetUp() override {
        RAYLIGN_MAKE_BACKEND(made, GetParam());
        backend_ = std::move(made);
    }
    [[nodiscard]] std::unique_ptr<Session> prepare(const RenderSettings& render = {}) const {
        return backend_->prepare({volume_, views_, render, {Metric::gc, {1.5, 4}}});
    }
    [[nodiscard]] std::string refusal(const RenderSettings& render = {}) const {
        return test::error_of([&] { (void)prepare(render); });
    }

    std::unique_ptr<Backend> backend_;
    Volume volume_ = test::spine_volume(17);
    std::vector<View> views_ =
        test::with_exact_images(test::biplane_views(32), spine_phantom({160, 160, 160}), test::oblique_pose());
};

TEST_P(BackendBadInput, PosesMustBeFiniteWhateverIsAsked) {
    const auto session = prepare();
    for (const double bad : {kNan, kInf, -kInf}) {
        RigidTransform turned = test::oblique_pose(), moved = test::oblique_pose();
        turned.rotation(2, 1) = bad;
        moved.translation_mm.z() = bad;
        for (const RigidTransform& pose : {turned, moved}) {
            const std::vector<RigidTransform> poses = {test::oblique_pose(), pose};
            std::vector<double> costs(2);
            std::vector<Linearization> results(2);
            EXPECT_THAT(test::error_of([&] { session->evaluate(poses, costs); }), testing::HasSubstr("pose 1"));
            EXPECT_THAT(test::error_of([&] {
                            session->linearize(poses, {0, 0, 0}, results);
                        }),
                        testing::HasSubstr("pose 1"));
            EXPECT_THAT(test::error_of([&] { (void)session->moment_sums(poses); }), testing::HasSubstr("pose 1"));
            EXPECT_THAT(test::error_of([&] { (void)session->render(pose, 0); }), testing::HasSubstr("must be finite"));
        }
    }
}

TEST_P(BackendBadInput, ASourceFartherThanNumbersReachIsRefused) {
    // A step of half a voxel is lost in the rounding of 1e17 voxels: samples could not be counted.
    for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
        const auto session = prepare({projector, {}});
        std::vector<double> cost(2);
        for (const double far_mm : {1e11, -1e17, 1e300}) {
            const std::vector<RigidTransform> poses = {{}, RigidTransform::translate({0, far_mm, 0})};
            EXPECT_THAT(test::error_of([&] { session->evaluate(poses, cost); }),
                        testing::AllOf(testing::HasSubstr("pose 1"), testing::HasSubstr("below 1e9 voxels")));
            EXPECT_THAT(test::error_of([&] { (void)session->render(poses[1], 0); }),
                        testing::HasSubstr("source and volume"));
        }
        const std::vector<RigidTransform> near = {{}, RigidTransform::translate({1e9, 0, 0})};
        session->evaluate(near, cost);
        EXPECT_EQ(cost[1], 1) << "as far away as that nothing is seen";
    }
}

TEST_P(BackendBadInput, ARotationCentreMustBeFinite) {
    if (!backend_->info().has_derivatives) GTEST_SKIP() << GetParam() << " has no derivatives";
    const auto session = prepare();
    const RigidTransform pose = test::oblique_pose();
    Linearization result;
    for (const double bad : {kNan, kInf}) {
        EXPECT_THAT(test::error_of([&] {
                        session->linearize({&pose, 1}, {0, bad, 0}, {&result, 1});
                    }),
                    testing::HasSubstr("rotation centre"));
    }
}

TEST_P(BackendBadInput, OneRowOfPixelsHasNoGradientAcrossItAndSaysSo) {
    const Phantom phantom = spine_phantom({160, 160, 160});
    for (const Eigen::Vector2i& size_px : {Eigen::Vector2i(70, 1), Eigen::Vector2i(1, 70)}) {
        for (View& view : views_) {
            view.geometry.camera =
                camera_from_pitch(size_px, 1500, {3, 3}, (size_px.cast<double>() - Eigen::Vector2d::Ones()) / 2);
            view.image = exact_drr(phantom, view.geometry, test::oblique_pose());
        }
        EXPECT_THAT(refusal(), testing::HasSubstr("the image is constant"));
        const auto session = backend_->prepare({volume_, views_, {}, {Metric::ncc, {}}});
        const RigidTransform pose = test::oblique_pose();
        const auto oracle = create_backend("reference").backend->prepare({volume_, views_, {}, {Metric::ncc, {}}});
        double cost = 0, expected = 0;
        session->evaluate({&pose, 1}, {&cost, 1});
        oracle->evaluate({&pose, 1}, {&expected, 1});
        EXPECT_NEAR(cost, expected, 1e-4) << "the image itself can be compared";  // 70 pixels average little away
        EXPECT_LT(cost, 0.9);
    }
}

TEST_P(BackendBadInput, AVoxelThatIsNotFiniteIsNamed) {
    const std::size_t last = volume_.attenuation_per_mm.size() - 1;
    for (const double bad : {kNan, kInf, -kInf}) {
        for (const std::size_t at : {std::size_t{0}, std::size_t{4095}, std::size_t{4096}, last}) {
            const float good = volume_.attenuation_per_mm[at];
            volume_.attenuation_per_mm[at] = static_cast<float>(bad);
            const std::string place = "(" + std::to_string(at % 17) + ", " + std::to_string(at / 17 % 17) + ", " +
                                      std::to_string(at / 289) + ")";
            EXPECT_THAT(refusal(), testing::AllOf(testing::HasSubstr("voxel " + place), testing::HasSubstr("finite")));
            volume_.attenuation_per_mm[at] = good;
        }
    }
    volume_.attenuation_per_mm[5] = std::numeric_limits<float>::max();
    volume_.attenuation_per_mm[6] = std::numeric_limits<float>::denorm_min();
    EXPECT_NO_THROW((void)prepare()) << "large and small are finite";
}

TEST_P(BackendBadInput, TwoToThe31VoxelsThatAreNotThereAreAnErrorBeforeAllocation) {
    volume_.grid.size = {2048, 1024, 1024};
    EXPECT_THAT(refusal(), testing::AllOf(testing::HasSubstr("voxel count = 4913"), testing::HasSubstr("2147483648")));
    volume_.grid.size = Eigen::Vector3i::Constant(std::numeric_limits<int>::max());  // beyond 64 bits
    EXPECT_THAT(refusal(), testing::HasSubstr("must be"));
}

TEST_P(BackendBadInput, GridsWithoutVoxelsOrWithImpossibleSpacingAreRefused) {
    const Volume good = volume_;
    for (const int size : {0, -1}) {
        volume_.grid.size.y() = size;
        EXPECT_THAT(refusal(), testing::HasSubstr("volume size"));
    }
    volume_ = good;
    for (const double spacing : {0.0, -1.0, kNan, kInf}) {
        volume_.grid.spacing_mm.z() = spacing;
        EXPECT_THAT(refusal(), testing::HasSubstr("volume spacing"));
    }
    volume_ = good;
    volume_.grid.origin_mm.x() = kNan;
    EXPECT_THAT(refusal(), testing::HasSubstr("volume origin"));
}

TEST_P(BackendBadInput, StepsMustBePositiveAndNotAbsurd) {
    for (const double step_mm : {-1.0, kNan, kInf, 1e-9, 101.0}) {
        EXPECT_THAT(refusal({Projector::trilinear, step_mm}), testing::HasSubstr("step_mm")) << step_mm;
    }
}

TEST_P(BackendBadInput, AViewThatIsNotThereIsRefused) {
    const auto session = prepare();
    EXPECT_THAT(test::error_of([&] { (void)session->render({}, 2); }), testing::HasSubstr("view = 2"));
    views_.clear();
    EXPECT_THAT(refusal(), testing::HasSubstr("at least one"));
}

INSTANTIATE_TEST_SUITE_P(All, BackendBadInput, testing::ValuesIn(backend_names()),
                         [](const auto& test) { return test::test_name(test.param); });

}  // namespace
}  // namespace raylign::detail

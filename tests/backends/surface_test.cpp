// Volumes that have a surface: every backend makes its DRRs by the same code, and its own filter and sums of them.

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/support/backends.h"
#include "tests/support/mesh_shapes.h"
#include "tests/support/scenes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail {
namespace {

/// A ball and a box beside it, of metal.
Surface implant() {
    Surface surface = test::joined(test::ball_mesh<Surface>({-12, 5, 8}, 22, 20),
                                   test::box_mesh<Surface>({14, -30, -20}, {40, 30, 12}));
    surface.attenuation_per_mm.assign(surface.triangles.size(), 0.06F);
    return surface;
}

Volume volume_of(std::shared_ptr<const Surface> surface) {
    Volume volume{centred_grid({40, 40, 40}, {2.5, 2.5, 2.5}), {}};
    volume.attenuation_per_mm.assign(64000, 0.01F);  // what no DRR of the surface shows
    volume.surface = std::move(surface);
    return volume;
}

class SurfaceBackend : public testing::TestWithParam<std::string> {
protected:
    void SetUp() override {
        RAYLIGN_MAKE_BACKEND(backend, GetParam());
        if (!backend->info().has_derivatives)
            GTEST_SKIP() << GetParam() << " casts rays through voxels, as the paper's";
        backend_ = std::move(backend);
        for (View& view : views_) view.ceiling = 3;
        const auto session = oracle_->prepare({volume_, views_, {}, {}});
        for (std::size_t v = 0; v < views_.size(); ++v) views_[v].image = session->render(test::oblique_pose(), v);
    }

    [[nodiscard]] std::unique_ptr<Session> prepare(Backend& backend) const {
        return backend.prepare({volume_, views_, {}, {Metric::gc, {1.5, 4}}});
    }

    const Volume volume_ = volume_of(std::make_shared<const Surface>(implant()));
    std::vector<View> views_ = test::biplane_views(160);
    const Eigen::Vector3d centre_ct_mm_{3, -5, 8};
    const RigidTransform start_ = exp((Twist() << 0.02, 0.03, -0.01, 1.5, 2, -1).finished()) * test::oblique_pose();
    const std::unique_ptr<Backend> oracle_ = create_backend("reference").backend;
    std::unique_ptr<Backend> backend_;
};

TEST_P(SurfaceBackend, ImagesAreTheReferencesToTheBit) {
    const auto session = prepare(*backend_), oracle = prepare(*oracle_);
    for (std::size_t v = 0; v < views_.size(); ++v) {
        const DrrWithDerivatives own = session->render_with_derivatives(start_, centre_ct_mm_, v);
        const DrrWithDerivatives right = oracle->render_with_derivatives(start_, centre_ct_mm_, v);
        EXPECT_EQ(own.drr.pixels, right.drr.pixels);
        EXPECT_EQ(session->render(start_, v).pixels, right.drr.pixels);
        for (std::size_t p = 0; p < 6; ++p) EXPECT_EQ(own.derivatives[p].pixels, right.derivatives[p].pixels) << p;
    }
    EXPECT_GT(session->volume_bytes(), 0U);
    EXPECT_NE(session->volume_layout(), "");
}

TEST_P(SurfaceBackend, SumsAreTheReferences) {
    const auto session = prepare(*backend_), oracle = prepare(*oracle_);
    const std::vector<RigidTransform> poses{start_, test::oblique_pose(), {}};
    std::vector<double> costs(3), right(3);
    session->evaluate(poses, costs);
    oracle->evaluate(poses, right);
    std::vector<Linearization> at(3), of_oracle(3);
    session->linearize(poses, centre_ct_mm_, at);
    oracle->linearize(poses, centre_ct_mm_, of_oracle);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(costs[i], right[i], test::kCost) << i;
        EXPECT_NEAR(at[i].cost, of_oracle[i].cost, test::kCost) << i;
        // The sums are of floats whose rounding is 1e-6 of them; at the true pose the gradient is none.
        const double scale = of_oracle[i].curvature.norm();
        EXPECT_LT((at[i].gradient - of_oracle[i].gradient).norm(), 1e-5 * scale) << i;
        EXPECT_LT((at[i].curvature - of_oracle[i].curvature).norm(), 1e-4 * scale) << i;
    }
    EXPECT_LT(costs[1], 1e-6);
    EXPECT_GT(costs[0], 0.01);
}

TEST_P(SurfaceBackend, GradientIsTheLimitOfDifferences) {
    const auto session = prepare(*backend_);
    Linearization at;
    session->linearize({&start_, 1}, centre_ct_mm_, {&at, 1});
    constexpr double kRadius_mm = 40, kStep = 0.6;  // half a pixel: an outline passes rays in steps
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
    EXPECT_LT((analytic - differences).norm(), 0.05 * differences.norm())
        << "analytic " << analytic.transpose() << "\ndifferences " << differences.transpose();
}

TEST_P(SurfaceBackend, OtherViewsGiveTheBitsOfAFreshSession) {
    std::vector<View> one(views_.begin(), views_.begin() + 1);
    const auto fresh = backend_->prepare({volume_, one, {}, {Metric::gc, {1, 3}}});
    const auto resident = prepare(*backend_);
    const auto other = resident->with_views(one, {Metric::gc, {1, 3}});
    for (int turn = 0; turn < 2; ++turn) {  // the same input, the same bits
        Linearization a, b;
        fresh->linearize({&start_, 1}, centre_ct_mm_, {&a, 1});
        other->linearize({&start_, 1}, centre_ct_mm_, {&b, 1});
        EXPECT_EQ(a.cost, b.cost);
        EXPECT_EQ(a.gradient, b.gradient);
        EXPECT_EQ(a.curvature, b.curvature);
    }
}

INSTANTIATE_TEST_SUITE_P(All, SurfaceBackend, testing::ValuesIn(backend_names()),
                         [](const auto& test) { return test::test_name(test.param); });

TEST(SurfaceOnThreads, HasTheSameBitsOnAnyNumber) {
    const Volume volume = volume_of(std::make_shared<const Surface>(implant()));
    std::vector<View> views = test::biplane_views(90);
    std::vector<Linearization> found;
    for (const int threads : {1, 3}) {
        BackendOptions options;
        options.cpu.threads = threads;
        std::unique_ptr<Backend> backend;
        try {
            backend = create_backend("cpu", options).backend;
        } catch (const Error& error) {
            GTEST_SKIP() << error.what();
        }
        if (views.front().image.empty()) {
            const auto session = backend->prepare({volume, views, {}, {}});
            for (std::size_t v = 0; v < views.size(); ++v) views[v].image = session->render(test::oblique_pose(), v);
        }
        const RigidTransform pose;
        backend->prepare({volume, views, {}, {}})->linearize({&pose, 1}, {0, 0, 0}, {&found.emplace_back(), 1});
    }
    EXPECT_EQ(found[0].cost, found[1].cost);
    EXPECT_EQ(found[0].gradient, found[1].gradient);
    EXPECT_EQ(found[0].curvature, found[1].curvature);
}

}  // namespace
}  // namespace raylign::detail

// The model of several objects at once: its cost against a session's, its derivatives against differences.

#include "core/registration/scene/scene_level.h"

#include <gtest/gtest.h>

#include <deque>

#include "core/image/region.h"
#include "raylign/backends.h"
#include "raylign/phantom.h"
#include "tests/support/backends.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

constexpr double kFloatCost = 2e-6;   // of a cost: sums of float channels in another order
constexpr double kFloatShare = 1e-3;  // of a derivative: float sums a row
constexpr double kDifference = 0.05;  // of a derivative: differences across kinks of the interpolant
constexpr double kCrossBlock = 0.01;  // of the largest curvature: second differences of costs near 0

Volume vertebra(int level) {
    const Eigen::Vector3d extent_mm(160, 160, 160);
    const Volume whole = voxelise(spine_vertebra(extent_mm, level), centred_grid({80, 80, 80}, {2, 2, 2}), 2);
    return crop(whole, box_of_object(whole));
}

/// Two vertebrae that overlap in the views: the second is shifted onto the first.
struct TwoObjects {
    explicit TwoObjects(const char* backend_name = "cpu", int side_px = 64)
        : backend(create_backend(backend_name, test::parity_options()).backend) {
        for (const Volume& volume : volumes) resident.emplace_back(volume, RenderSettings{}, *backend);
        level.views = test::biplane_views(side_px, 160);
        level.similarity = {Metric::gc, {1.5, 5}};
        level.pixel_at_object_mm = 160.0 / side_px;
        poses = {test::oblique_pose(), RigidTransform::translate({8, 5, -22}) * test::oblique_pose()};
        for (std::size_t v = 0; v < level.views.size(); ++v) {
            View& view = level.views[v];
            view.image = Image(side_px, side_px);
            for (std::size_t k = 0; k < volumes.size(); ++k) add_drr(view, v, k);
            level.fixed.push_back(make_fixed_channels(view, level.similarity));
            level.base_weights.push_back(level.fixed.back().weights);
        }
        for (ResidentVolume& volume : resident) {
            level.objects.emplace_back(volume, 0, level.views, level.similarity, level.pixel_at_object_mm);
        }
    }
    void add_drr(View& view, std::size_t v, std::size_t k) {
        const auto session = resident[k].session(0, test::biplane_views(view.image.width, 160), level.similarity);
        const Image drr = session->render(poses[k], v);
        for (std::size_t i = 0; i < drr.pixels.size(); ++i) view.image.pixels[i] += drr.pixels[i];
    }
    /// The poses moved by the parameters of both objects.
    [[nodiscard]] std::vector<RigidTransform> moved(const std::vector<RigidTransform>& from,
                                                    const Eigen::VectorXd& x) const {
        return {make_pose_space(from[0], resident[0].extent()).pose(x.head<6>()),
                make_pose_space(from[1], resident[1].extent()).pose(x.tail<6>())};
    }
    [[nodiscard]] double cost(const std::vector<RigidTransform>& from, const Eigen::VectorXd& x) {
        return scene_cost(level, moved(from, x));
    }

    std::vector<Volume> volumes{vertebra(1), vertebra(2)};
    std::unique_ptr<Backend> backend;
    std::deque<ResidentVolume> resident;
    std::vector<RigidTransform> poses;
    SceneLevel level;
};

Eigen::VectorXd unit(int i, double length) {
    Eigen::VectorXd x = Eigen::VectorXd::Zero(12);
    x[i] = length;
    return x;
}

}  // namespace

TEST(SceneLevel, SumOfObjectsExplainsTheirOwnSum) {
    TwoObjects scene;
    EXPECT_LT(scene_cost(scene.level, scene.poses), kFloatCost);
    const double apart = scene.cost(scene.poses, unit(3, 4));
    EXPECT_GT(apart, 0.01);
}

TEST(SceneLevel, OneObjectCostsAndDerivesAsItsSession) {
    TwoObjects scene;
    scene.level.objects.pop_back();
    const RigidTransform pose = RigidTransform::translate({1.5, -1, 2}) * scene.poses[0];
    const LocalModel model = scene_model(scene.level, {{pose}, {0}});
    const auto session = scene.resident[0].session(0, scene.level.views, scene.level.similarity);
    Linearization at;
    session->linearize({&pose, 1}, scene.resident[0].extent().centre_ct_mm, {&at, 1});
    Eigen::VectorXd scale = Eigen::VectorXd::Ones(6);
    scale.head<3>() /= scene.resident[0].extent().radius_mm;
    const Eigen::VectorXd gradient = scale.cwiseProduct(Eigen::VectorXd(at.gradient));
    const Eigen::MatrixXd curvature = scale.asDiagonal() * at.curvature * scale.asDiagonal();
    EXPECT_NEAR(model.cost, at.cost, kFloatCost);
    EXPECT_LT((model.gradient - gradient).norm(), kFloatShare * gradient.norm());
    EXPECT_LT((model.curvature - curvature).norm(), kFloatShare * curvature.norm());
}

TEST(SceneLevel, GradientIsThatOfTheCost) {
    TwoObjects scene;
    const std::vector<RigidTransform> off = scene.moved(scene.poses, unit(3, 2) + unit(1, 1) + unit(10, -2));
    const LocalModel model = scene_model(scene.level, {off, {0, 1}});
    Eigen::VectorXd differences(12);
    for (int i = 0; i < 12; ++i) {
        differences[i] = (scene.cost(off, unit(i, 0.2)) - scene.cost(off, unit(i, -0.2))) / 0.4;
    }
    EXPECT_LT((model.gradient - differences).norm(), kDifference * differences.norm())
        << model.gradient.transpose() << "\n"
        << differences.transpose();
}

// Where the sum fits exactly, the Gauss-Newton matrix is the second derivative: cross blocks and all.
TEST(SceneLevel, CrossBlocksAreSecondDifferencesOfTheCost) {
    TwoObjects scene;
    const LocalModel model = scene_model(scene.level, {scene.poses, {0, 1}});
    const double h = 0.4;
    double largest_cross = 0;
    for (int i = 0; i < 6; ++i) {
        for (int j = 6; j < 12; ++j) {
            const auto at = [&](double a, double b) { return scene.cost(scene.poses, unit(i, a) + unit(j, b)); };
            const double second = (at(h, h) - at(h, -h) - at(-h, h) + at(-h, -h)) / (4 * h * h);
            EXPECT_NEAR(model.curvature(i, j), second, kCrossBlock * model.curvature.maxCoeff()) << i << " " << j;
            largest_cross = std::max(largest_cross, std::abs(second));
        }
    }
    EXPECT_GT(largest_cross, 10 * kCrossBlock * model.curvature.maxCoeff()) << "the objects must overlap";
}

TEST(SceneLevel, ObjectThatStaysHasNoDerivativesButShows) {
    TwoObjects scene;
    const LocalModel both = scene_model(scene.level, {scene.poses, {0, 1}});
    const LocalModel second = scene_model(scene.level, {scene.poses, {1}});
    ASSERT_EQ(second.gradient.size(), 6);
    EXPECT_EQ(second.cost, both.cost);
    EXPECT_EQ(second.curvature, both.curvature.bottomRightCorner(6, 6));
}

TEST(SceneLevel, BackendsAgree) {
    TwoObjects reference("reference", 32);
    const Eigen::VectorXd off = unit(3, 2) + unit(10, -2);
    const auto model_of = [&](TwoObjects& scene) {
        return scene_model(scene.level, {scene.moved(scene.poses, off), {0, 1}});
    };
    const LocalModel expected = model_of(reference);
    for (const char* name : {"cpu", "gl"}) {
        if (std::string(name) == "gl" && !test::is_required(name)) continue;  // software GL is taken by name only
        TwoObjects scene(name, 32);
        const LocalModel model = model_of(scene);
        EXPECT_NEAR(model.cost, expected.cost, kFloatCost) << name;
        EXPECT_LT((model.gradient - expected.gradient).norm(), 1e-3 * expected.gradient.norm()) << name;
        EXPECT_LT((model.curvature - expected.curvature).norm(), 1e-3 * expected.curvature.norm()) << name;
    }
}

}  // namespace raylign::detail

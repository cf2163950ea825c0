// Parity ladder, step 2: sums and costs of every instruction set against the reference.
#include <array>
#include <cmath>

#include "cpu_scenes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail::test {
namespace {

NamedScene cost_scene(const Eigen::Vector2i& size_px, bool masked) {
    NamedScene scene{"cost", random_volume({40, 44, 36}, {1, 0.9, 1.2}, 21, 0.5), {}};
    scene.views = {view_along(rotation(20, 30, 10), size_px, 60.0 / size_px.minCoeff()),
                   view_along(rotation(95, 30, 10), size_px, 60.0 / size_px.minCoeff())};
    add_images(scene, pose_near_identity(5, 0.3));
    if (!masked) return scene;
    for (View& view : scene.views) {
        view.weights = Image(size_px.x(), size_px.y(), 1);
        for (int y = 0; y < size_px.y(); ++y) {
            for (int x = 0; x < size_px.x(); ++x) {
                if (x > 0.6 * size_px.x() || (x + y) % 97 == 0)
                    view.weights(x, y) = 0;
                else if (y % 3 == 0)
                    view.weights(x, y) = 0.5F;
            }
        }
        view.image(0, 0) = std::nanf("");  // masked: its value must not matter
    }
    return scene;
}

class CpuCost : public testing::TestWithParam<std::string> {
protected:
    static void expect_equal_costs(const NamedScene& named, Projector projector, const Similarity& similarity) {
        const Scene scene = named.scene(projector, similarity);
        auto backend = make_cpu_backend(
            {.threads = 2, .instruction_set = instruction_set_from_name(GetParam()), .storage = Storage::float32});
        ASSERT_EQ(backend->info().instruction_set, GetParam());
        auto session = backend->prepare(scene);
        auto reference = make_reference_backend()->prepare(scene);
        std::vector<RigidTransform> poses = {{}};
        for (unsigned seed = 30; seed < 34; ++seed) poses.push_back(pose_near_identity(seed));
        std::vector<double> costs(poses.size()), truth(poses.size());
        session->evaluate(poses, costs);
        reference->evaluate(poses, truth);
        const std::vector<MomentSums> sums = session->moment_sums(poses), true_sums = reference->moment_sums(poses);
        for (std::size_t i = 0; i < poses.size(); ++i) {
            EXPECT_TRUE(std::abs(costs[i] - truth[i]) <= kCost) << "pose " << i << ": " << costs[i] << " " << truth[i];
        }
        for (std::size_t i = 0; i < sums.size(); ++i) {
            EXPECT_EQ(sums[i].weight, true_sums[i].weight);
            EXPECT_EQ(sums[i].fixed, true_sums[i].fixed);
            EXPECT_EQ(sums[i].fixed_fixed, true_sums[i].fixed_fixed);
            EXPECT_NEAR(sums[i].moving_moving, true_sums[i].moving_moving, 1e-5 * true_sums[i].moving_moving);
        }
    }
};

/// Gradient and curvature against the reference, relative to their size: 1e-4, since derivative images are differences
/// of neighbouring voxels, whose float errors weigh more than in the image.
void expect_equal_linearizations(const NamedScene& named, Projector projector, const Similarity& similarity,
                                 const std::string& instruction_set) {
    const Scene scene = named.scene(projector, similarity);
    auto session =
        make_cpu_backend(
            {.threads = 2, .instruction_set = instruction_set_from_name(instruction_set), .storage = Storage::float32})
            ->prepare(scene);
    auto reference = make_reference_backend()->prepare(scene);
    std::vector<RigidTransform> poses;
    for (unsigned seed = 30; seed < 33; ++seed) poses.push_back(pose_near_identity(seed));
    std::vector<Linearization> found(poses.size()), truth(poses.size());
    const Eigen::Vector3d centre_ct_mm(2, -3, 1);
    session->linearize(poses, centre_ct_mm, found);
    reference->linearize(poses, centre_ct_mm, truth);
    for (std::size_t i = 0; i < poses.size(); ++i) {
        EXPECT_NEAR(found[i].cost, truth[i].cost, kCost);
        EXPECT_LT((found[i].gradient - truth[i].gradient).norm(), 1e-4 * truth[i].gradient.norm()) << "pose " << i;
        EXPECT_LT((found[i].curvature - truth[i].curvature).norm(), 1e-4 * truth[i].curvature.norm()) << "pose " << i;
    }
}

TEST_P(CpuCost, DerivativesEqualReference) {
    for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
        expect_equal_linearizations(cost_scene({45, 37}, true), projector, {Metric::ncc, {}}, GetParam());
        expect_equal_linearizations(cost_scene({45, 37}, false), projector, {Metric::gc, {1.5, 4}}, GetParam());
    }
    expect_equal_linearizations(cost_scene({150, 131}, true), Projector::joseph, {Metric::gc, {1, 3}}, GetParam());
}

TEST_P(CpuCost, DerivativesAreRightWithTheSourceInsideAndTheDetectorBeforeTheVolumesEnd) {
    for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
        NamedScene scene = cost_scene({33, 40}, false);
        for (View& view : scene.views) {
            view.geometry.camera_from_world.translation_mm = {0, 0, 5};  // 5 mm behind the volume's centre
            view.geometry.camera.sdd_mm = 14;
            view.geometry.camera.intrinsics_px.topLeftCorner<2, 2>() *= 20.0 / 900;
        }
        add_images(scene, pose_near_identity(5, 0.3));
        expect_equal_linearizations(scene, projector, {Metric::ncc, {}}, GetParam());
    }
}

TEST_P(CpuCost, LinearizingHasTheSameBitsAtAnyNumberOfThreadsAndInAnyBatch) {
    const NamedScene named = cost_scene({45, 37}, false);
    const Scene scene = named.scene(Projector::joseph, {});
    std::vector<RigidTransform> poses;
    for (unsigned seed = 40; seed < 52; ++seed) poses.push_back(pose_near_identity(seed));
    std::vector<Linearization> first(poses.size()), other(poses.size());
    make_cpu_backend(
        {.threads = 1, .instruction_set = instruction_set_from_name(GetParam()), .storage = Storage::float32})
        ->prepare(scene)
        ->linearize(poses, {0, 0, 0}, first);
    auto session =
        make_cpu_backend(
            {.threads = 3, .instruction_set = instruction_set_from_name(GetParam()), .storage = Storage::float32})
            ->prepare(scene);
    for (std::size_t i = 0; i < poses.size(); ++i) session->linearize({&poses[i], 1}, {0, 0, 0}, {&other[i], 1});
    for (std::size_t i = 0; i < poses.size(); ++i) {
        EXPECT_EQ(first[i].cost, other[i].cost);
        EXPECT_EQ(first[i].gradient, other[i].gradient);
        EXPECT_EQ(first[i].curvature, other[i].curvature);
    }
}

TEST_P(CpuCost, GradientCorrelationEqualsReference) {
    for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
        expect_equal_costs(cost_scene({45, 37}, false), projector, {});
    }
}

TEST_P(CpuCost, NormalizedCrossCorrelationEqualsReference) {
    expect_equal_costs(cost_scene({45, 37}, false), Projector::joseph, {Metric::ncc, {}});
    expect_equal_costs(cost_scene({45, 37}, true), Projector::joseph, {Metric::ncc, {}});
}

TEST_P(CpuCost, LargeImagesAreCutIntoTilesAndBands) {
    expect_equal_costs(cost_scene({150, 131}, false), Projector::joseph, {});
}

TEST_P(CpuCost, FilterWiderThanTheImage) {
    expect_equal_costs(cost_scene({13, 9}, false), Projector::joseph, {Metric::gc, {4, 20}});
}

TEST_P(CpuCost, MasksAreExact) {
    expect_equal_costs(cost_scene({160, 140}, true), Projector::joseph, {Metric::gc, {1, 3}});
}

TEST_P(CpuCost, CameraLookingAwayCostsOne) {
    const NamedScene named = cost_scene({45, 37}, false);
    auto session =
        make_cpu_backend(
            {.threads = 1, .instruction_set = instruction_set_from_name(GetParam()), .storage = Storage::float32})
            ->prepare(named.scene(Projector::joseph));
    const std::array<RigidTransform, 1> away = {RigidTransform::translate({5000, 5000, 5000})};
    std::array<double, 1> cost{};
    session->evaluate(away, cost);
    EXPECT_EQ(cost[0], 1);
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, CpuCost, testing::ValuesIn(available_sets()),
                         [](const testing::TestParamInfo<std::string>& test) { return test.param; });

}  // namespace
}  // namespace raylign::detail::test

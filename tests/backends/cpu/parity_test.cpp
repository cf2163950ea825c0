// Parity ladder, step 2: the images of every instruction set against the reference.
#include <algorithm>
#include <cmath>

#include "parity_scenes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail::test {
namespace {

using ParityCase = std::tuple<std::string, Projector, NamedScene>;
std::string case_name(const testing::TestParamInfo<ParityCase>& test) {
    return std::get<0>(test.param) + "_" + std::string(projector_name(std::get<1>(test.param))) + "_" +
           std::get<2>(test.param).name;
}

class CpuParity : public testing::TestWithParam<ParityCase> {};

TEST_P(CpuParity, ImageEqualsReference) {
    const auto& [set, projector, named] = GetParam();
    const Scene scene = named.scene(projector);
    auto backend = make_cpu_backend(
        {.threads = 2, .instruction_set = instruction_set_from_name(set), .storage = Storage::float32});
    ASSERT_EQ(backend->info().instruction_set, set);
    auto session = backend->prepare(scene);
    auto reference = make_reference_backend()->prepare(scene);
    for (std::size_t view = 0; view < named.views.size(); ++view) {
        for (const RigidTransform& pose : {RigidTransform{}, pose_near_identity(3), pose_near_identity(4, 0.01)}) {
            const Image image = session->render(pose, view), truth = reference->render(pose, view);
            const float maximum = *std::ranges::max_element(truth.pixels);
            float error = 0;
            std::size_t worst = 0;
            for (std::size_t i = 0; i < truth.pixels.size(); ++i) {
                const float difference = std::abs(image.pixels[i] - truth.pixels[i]);
                if (!(difference <= error)) {
                    error = difference;
                    worst = i;
                }
            }
            EXPECT_TRUE(error <= kFloatImageShare * maximum)
                << "view " << view << ": " << error / maximum << " of the maximum " << maximum << " at pixel ("
                << worst % truth.width << ", " << worst / truth.width << "): " << image.pixels[worst] << " instead of "
                << truth.pixels[worst];
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Scenes, CpuParity,
                         testing::Combine(testing::ValuesIn(available_sets()),
                                          testing::Values(Projector::joseph, Projector::trilinear),
                                          testing::ValuesIn(parity_scenes())),
                         case_name);

class CpuDerivatives : public testing::TestWithParam<ParityCase> {};

/// Gradient and curvature relative to their size. 1e-4, since derivative images are differences of neighbouring voxels,
/// whose float errors weigh more than in the image; moments count from the source, so the error grows with its
/// distance. The field has kinks on voxel planes: where rounding takes a sample to the other side of one, a slope is
/// another, and among random voxels that shows. It hits a pose by chance (about one in twelve), so one of three may be
/// off by more.
TEST_P(CpuDerivatives, LinearizationEqualsReference) {
    auto [set, projector, named] = GetParam();
    named.views.resize(1);  // the others may miss the volume
    add_images(named, pose_near_identity(7, 0.2));
    const Scene scene = named.scene(projector, {Metric::ncc, {}});
    const auto session =
        make_cpu_backend({.threads = 2, .instruction_set = instruction_set_from_name(set), .storage = Storage::float32})
            ->prepare(scene);
    const auto reference = make_reference_backend()->prepare(scene);
    const double source_mm = named.views[0].geometry.camera_from_world.translation_mm.norm();
    const double tolerance = 1e-4 * std::max(1.0, source_mm / 600);
    int close = 0;
    for (const unsigned seed : {1, 2, 3}) {
        const RigidTransform pose = pose_near_identity(seed, 0.5);
        Linearization found, truth;
        session->linearize({&pose, 1}, {2, -3, 1}, {&found, 1});
        reference->linearize({&pose, 1}, {2, -3, 1}, {&truth, 1});
        EXPECT_NEAR(found.cost, truth.cost, kCost);
        const double gradient = (found.gradient - truth.gradient).norm() / truth.gradient.norm();
        const double curvature = (found.curvature - truth.curvature).norm() / truth.curvature.norm();
        EXPECT_LT(gradient, 100 * tolerance) << "seed " << seed;
        EXPECT_LT(curvature, 100 * tolerance) << "seed " << seed;
        close += gradient < tolerance && curvature < tolerance;
    }
    EXPECT_GE(close, 2);
}

/// Without those whose rays run on voxel planes, where there is no derivative, or that nothing can be compared on.
std::vector<NamedScene> scenes_with_derivatives() {
    std::vector<NamedScene> scenes = parity_scenes();
    std::erase_if(scenes, [](const NamedScene& scene) {
        return scene.name == "along_z_on_planes" || scene.name == "one_voxel" || scene.name == "detector_before_volume";
    });
    return scenes;
}

INSTANTIATE_TEST_SUITE_P(Scenes, CpuDerivatives,
                         testing::Combine(testing::ValuesIn(available_sets()),
                                          testing::Values(Projector::joseph, Projector::trilinear),
                                          testing::ValuesIn(scenes_with_derivatives())),
                         case_name);

}  // namespace
}  // namespace raylign::detail::test

// Voxels as int16: the error stays below the bound that volume_layouts.h states.
#include <algorithm>
#include <cmath>

#include "cpu_scenes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail::test {
namespace {

class CpuInt16 : public testing::TestWithParam<std::tuple<std::string, Projector>> {
protected:
    NamedScene named_{
        "int16",
        random_volume({40, 44, 36}, {1, 0.9, 1.2}, 21, 0.3),
        {view_along(rotation(20, 30, 10), {45, 37}, 1.6), view_along(rotation(100, 10, 50), {40, 40}, 4)}};
    CpuOptions options_{
        .threads = 2, .instruction_set = instruction_set_from_name(std::get<0>(GetParam())), .storage = Storage::int16};
    Projector projector_ = std::get<1>(GetParam());
};

TEST_P(CpuInt16, ImageErrorIsBelowHalfAUnitTimesThePathInTheVolume) {
    auto session = make_cpu_backend(options_)->prepare(named_.scene(projector_));
    auto reference = make_reference_backend()->prepare(named_.scene(projector_));
    NamedScene ones = named_;
    std::ranges::fill(ones.volume.attenuation_per_mm, 1.F);
    auto path_mm = make_reference_backend()->prepare(ones.scene(projector_));
    const double half_unit = *std::ranges::max_element(named_.volume.attenuation_per_mm) / 65534.0;
    double largest_share = 0;
    for (const std::size_t view : {0, 1}) {
        const RigidTransform pose = pose_near_identity(3);
        const Image image = session->render(pose, view), truth = reference->render(pose, view),
                    path = path_mm->render(pose, view);
        const float maximum = *std::ranges::max_element(truth.pixels);
        for (std::size_t i = 0; i < image.pixels.size(); ++i) {
            const double error = std::abs(image.pixels[i] - truth.pixels[i]);
            EXPECT_TRUE(error <= half_unit * path.pixels[i] + kFloatImageShare * maximum)
                << "view " << view << " pixel " << i;
            largest_share = std::max(largest_share, error / maximum);
        }
    }
    RecordProperty("largest_share_of_maximum", std::to_string(largest_share));
    EXPECT_LE(largest_share, kFloatImageShare);  // far below the bound: rounding errors of many voxels cancel
}

TEST_P(CpuInt16, CostEqualsReference) {
    add_images(named_, pose_near_identity(5, 0.3));
    auto session = make_cpu_backend(options_)->prepare(named_.scene(projector_));
    auto reference = make_reference_backend()->prepare(named_.scene(projector_));
    const std::vector<RigidTransform> poses = {{}, pose_near_identity(30), pose_near_identity(31)};
    std::vector<double> costs(poses.size()), truth(poses.size());
    session->evaluate(poses, costs);
    reference->evaluate(poses, truth);
    for (std::size_t i = 0; i < poses.size(); ++i) EXPECT_TRUE(std::abs(costs[i] - truth[i]) <= kCost) << "pose " << i;
}

/// A millionth of the image's size is a thousandth of the slopes of noise, which are differences of its voxels.
TEST_P(CpuInt16, LinearizationEqualsReference) {
    add_images(named_, pose_near_identity(5, 0.3));
    for (const Metric metric : {Metric::gc, Metric::ncc}) {
        const Scene scene = named_.scene(projector_, {metric, {1.5, 4}});
        auto session = make_cpu_backend(options_)->prepare(scene);
        auto reference = make_reference_backend()->prepare(scene);
        const std::vector<RigidTransform> poses = {{}, pose_near_identity(30), pose_near_identity(31)};
        std::vector<Linearization> found(poses.size()), truth(poses.size());
        session->linearize(poses, {2, -3, 1}, found);
        reference->linearize(poses, {2, -3, 1}, truth);
        for (std::size_t i = 0; i < poses.size(); ++i) {
            EXPECT_TRUE(std::abs(found[i].cost - truth[i].cost) <= kCost) << "pose " << i;
            EXPECT_LT((found[i].gradient - truth[i].gradient).norm(), 1e-3 * truth[i].gradient.norm()) << "pose " << i;
            EXPECT_LT((found[i].curvature - truth[i].curvature).norm(), 1e-3 * truth[i].curvature.norm()) << i;
        }
    }
}

TEST_P(CpuInt16, TakesHalfTheMemory) {
    options_.storage = Storage::float32;
    named_.volume = random_volume({70, 70, 64}, {1, 1, 1}, 21);
    const Scene scene = named_.scene(projector_);
    const std::size_t floats = make_cpu_backend(options_)->prepare(scene)->volume_bytes();
    options_.storage = Storage::int16;
    const std::size_t shorts = make_cpu_backend(options_)->prepare(scene)->volume_bytes();
    EXPECT_LT(shorts, 0.7 * floats);  // rows are padded to cache lines, which weighs in a small volume
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, CpuInt16,
                         testing::Combine(testing::ValuesIn(available_sets()),
                                          testing::Values(Projector::joseph, Projector::trilinear)),
                         [](const testing::TestParamInfo<std::tuple<std::string, Projector>>& test) {
                             return std::get<0>(test.param) + "_" +
                                    std::string(projector_name(std::get<1>(test.param)));
                         });

}  // namespace
}  // namespace raylign::detail::test

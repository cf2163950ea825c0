// Images of several bands, each of several stretches of rows: those of which nothing counts are left out, and the next
// one is filtered as if they had not been.
#include <algorithm>
#include <cmath>

#include "cpu_scenes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail::test {
namespace {

constexpr int kAcross = 149, kDown = 300;  // three bands across, the last one cut short, and three down

/// A small object in large views: of most bands all is zero, and it ends in the middle of others.
NamedScene small_object() {
    NamedScene scene{"bands", random_volume({24, 20, 28}, {1, 0.9, 1.2}, 21), {}};
    scene.views = {view_along(rotation(20, 30, 10), {kAcross, kDown}, 0.5),
                   view_along(rotation(95, 30, 10), {kDown, kAcross}, 0.5)};
    add_images(scene, pose_near_identity(5, 0.3));
    return scene;
}

/// Rows [begin, end) count, and of them not the columns from 70 to 90.
Image rows_that_count(const View& view, int begin, int end) {
    Image weights(view.image.width, view.image.height);
    for (int y = begin; y < std::min(end, weights.height); ++y) {
        for (int x = 0; x < weights.width; ++x) weights(x, y) = x < 70 || x >= 90 ? 1.F + 0.01F * (x % 7) : 0.F;
    }
    return weights;
}

class CpuBands : public testing::TestWithParam<std::string> {
protected:
    NamedScene named_ = small_object();
    std::vector<RigidTransform> poses_ = {{}, pose_near_identity(30, 2), pose_near_identity(31, 2)};

    void expect_reference_sums(const Similarity& similarity, std::span<const Image> weights = {}) const {
        const Scene scene = named_.scene(Projector::joseph, similarity);
        const CpuOptions options{
            .threads = 2, .instruction_set = instruction_set_from_name(GetParam()), .storage = Storage::float32};
        const auto ours = make_cpu_backend(options)->prepare(scene), oracle = make_reference_backend()->prepare(scene);
        if (!weights.empty()) {
            ours->set_weights(weights);
            oracle->set_weights(weights);
        }
        std::vector<double> costs(poses_.size()), truth(poses_.size());
        ours->evaluate(poses_, costs);
        oracle->evaluate(poses_, truth);
        std::vector<Linearization> found(poses_.size()), exact(poses_.size());
        ours->linearize(poses_, {2, -3, 1}, found);
        oracle->linearize(poses_, {2, -3, 1}, exact);
        for (std::size_t i = 0; i < poses_.size(); ++i) {
            EXPECT_TRUE(std::abs(costs[i] - truth[i]) <= kCost) << i << ": " << costs[i] << " " << truth[i];
            EXPECT_TRUE(std::abs(found[i].cost - truth[i]) <= kCost) << i << ": " << found[i].cost << " " << truth[i];
            EXPECT_LT((found[i].gradient - exact[i].gradient).norm(), 1e-3 * exact[i].gradient.norm()) << i;
            EXPECT_LT((found[i].curvature - exact[i].curvature).norm(), 1e-3 * exact[i].curvature.norm()) << i;
        }
    }
};

TEST_P(CpuBands, OfASmallObjectGiveTheSumsOfTheReference) {
    expect_reference_sums({Metric::gc, {3, 9}});
    expect_reference_sums({Metric::gc, {1, 2}});
    expect_reference_sums({Metric::gc, {12, 40}});  // farther than a stretch
    expect_reference_sums({Metric::ncc, {}});
}

TEST_P(CpuBands, WhoseRowsDoNotAllCountGiveTheSumsOfTheReference) {
    for (const Metric metric : {Metric::gc, Metric::ncc}) {
        std::vector<Image> weights;
        for (const View& view : named_.views) weights.push_back(rows_that_count(view, 40, 100));
        for (int y = 140; y < 150; ++y) {
            for (int x = 0; x < kAcross; ++x) weights[0](x, y) = 1;  // two stretches later in the next band
        }
        for (int y = 190; y < 260; ++y) weights[0](60, y) = 2;
        expect_reference_sums({metric, {3, 9}}, weights);
    }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, CpuBands, testing::ValuesIn(available_sets()),
                         [](const testing::TestParamInfo<std::string>& test) { return test.param; });

}  // namespace
}  // namespace raylign::detail::test

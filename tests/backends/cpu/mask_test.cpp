// Pixels that no weight reaches are never cast, and new weights move that border without changing anything else.
#include <algorithm>
#include <cmath>

#include "backends/cpu/frame_plan.h"
#include "backends/cpu/kernel_dispatch.h"
#include "backends/cpu/volume_layouts.h"
#include "cpu_scenes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail::test {
namespace {

constexpr int kWidth = 101, kHeight = 70;  // 4 x 3 tiles, the last ones cut short

struct Region {
    int x0, y0, x1, y1;
};

/// Waves that fade out towards the volume's sides. Smooth, so that a sample that rounding takes to the other side of a
/// voxel plane finds nearly the same slope there.
Volume waves() {
    Volume volume = random_volume({40, 44, 36}, {1, 0.9, 1.2}, 21);
    const auto fade = [](double x, int n) { return std::pow(std::sin(EIGEN_PI * (x + 1) / (n + 1)), 2); };
    for (int z = 0; z < 36; ++z) {
        for (int y = 0; y < 44; ++y) {
            for (int x = 0; x < 40; ++x) {
                const double wave = 1 + std::sin(0.4 * x + 0.3 * y) * std::cos(0.35 * z + 0.2 * x - 0.1 * y);
                volume.attenuation_per_mm[volume.index(x, y, z)] =
                    static_cast<float>(0.02 * wave * fade(x, 40) * fade(y, 44) * fade(z, 36));
            }
        }
    }
    return volume;
}

NamedScene masked_scene() {
    NamedScene scene{"mask", waves(), {}};
    scene.views = {view_along(rotation(20, 30, 10), {kWidth, kHeight}, 0.9),
                   view_along(rotation(95, 30, 10), {kWidth, kHeight}, 0.9)};
    add_images(scene, pose_near_identity(5, 0.3));
    return scene;
}

/// One in the region (0.5 in every third row), zero elsewhere.
Image weights_in(const Region& region) {
    Image weights(kWidth, kHeight);
    for (int y = region.y0; y < region.y1; ++y) {
        for (int x = region.x0; x < region.x1; ++x) weights(x, y) = y % 3 == 0 ? 0.5F : 1.F;
    }
    return weights;
}

using MaskCase = std::tuple<std::string, Projector, std::string>;

class CpuMask : public testing::TestWithParam<MaskCase> {
protected:
    NamedScene named_ = masked_scene();
    std::vector<RigidTransform> poses_ = {pose_near_identity(30), pose_near_identity(31)};

    [[nodiscard]] std::unique_ptr<Session> session(const Similarity& similarity) const {
        const auto& [set, projector, storage] = GetParam();
        return make_cpu_backend({.threads = 2,
                                 .instruction_set = instruction_set_from_name(set),
                                 .storage = storage_from_name(storage)})
            ->prepare(named_.scene(projector, similarity));
    }
    [[nodiscard]] std::unique_ptr<Session> reference(const Similarity& similarity) const {
        return make_reference_backend()->prepare(named_.scene(std::get<1>(GetParam()), similarity));
    }
    void expect_equal(Session& session, Session& reference) const {
        std::vector<double> costs(poses_.size()), truth(poses_.size());
        session.evaluate(poses_, costs);
        reference.evaluate(poses_, truth);
        std::vector<Linearization> found(poses_.size()), exact(poses_.size());
        session.linearize(poses_, {2, -3, 1}, found);
        reference.linearize(poses_, {2, -3, 1}, exact);
        // 16-bit voxels move slopes more than values.
        const double share = std::get<2>(GetParam()) == "int16" ? 1e-3 : 1e-4;
        for (std::size_t i = 0; i < poses_.size(); ++i) {
            EXPECT_TRUE(std::abs(costs[i] - truth[i]) <= kCost) << i << ": " << costs[i] << " " << truth[i];
            EXPECT_TRUE(std::abs(found[i].cost - truth[i]) <= kCost) << i << ": " << found[i].cost << " " << truth[i];
            EXPECT_LT((found[i].gradient - exact[i].gradient).norm(), share * exact[i].gradient.norm()) << i;
            EXPECT_LT((found[i].curvature - exact[i].curvature).norm(), share * exact[i].curvature.norm()) << i;
        }
    }
};

TEST_P(CpuMask, NewWeightsThatLeaveOutWholeTilesGiveTheSumsOfTheReference) {
    const Similarity similarity{Metric::gc, {1, 3}};
    const auto ours = session(similarity), oracle = reference(similarity);
    // From within a tile to all of the image and back, the views unlike: what was cast before must not matter.
    const Region all{0, 0, kWidth, kHeight};
    const Region regions[][2] = {{{50, 35, 63, 47}, {33, 20, 60, 40}}, {all, {40, 0, 90, 31}}, {{64, 31, 80, 64}, all}};
    for (const auto& region : regions) {
        const std::vector<Image> weights = {weights_in(region[0]), weights_in(region[1])};
        ours->set_weights(weights);
        oracle->set_weights(weights);
        expect_equal(*ours, *oracle);
    }
}

TEST_P(CpuMask, CostsUnderNewWeightsAreThoseOfASessionMadeWithThem) {
    const Similarity similarity{Metric::ncc, {}};
    const std::vector<Image> weights = {weights_in({50, 35, 63, 47}), weights_in({33, 20, 60, 40})};
    const auto changed = session(similarity);
    std::vector<double> before(poses_.size()), first(poses_.size()), second(poses_.size());
    changed->evaluate(poses_, before);
    changed->set_weights(weights);
    changed->evaluate(poses_, first);
    for (std::size_t view = 0; view < 2; ++view) named_.views[view].weights = weights[view];
    session(similarity)->evaluate(poses_, second);
    EXPECT_EQ(first, second);
    EXPECT_NE(first, before);
}

TEST_P(CpuMask, PixelsThatNoWeightReachesAreNotCast) {
    const auto& [set, projector, storage_name] = GetParam();
    const cpu::VoxelStorage storage = storage_name == "int16" ? cpu::kInt16 : cpu::kFloat32;
    const cpu::KernelTable& kernels = cpu::choose_kernels(instruction_set_from_name(set));
    cpu::Workers workers(1);
    cpu::VolumeLayouts layouts = cpu::make_layouts(named_.volume, {.wanted = storage}, 0, workers);
    for (int axis = 1; axis < 3; ++axis) layouts.make(axis, workers);
    const View& view = named_.views[0];
    // Weight in two corners of the first tile, none in the second; the filter reaches 3 pixels further.
    FixedChannels fixed{{Image(kWidth, kHeight, 1)}, weights_in({4, 4, 9, 6})};
    fixed.weights(30, 31) = 1;
    cpu::ViewPlan plan = cpu::make_view_plan({kWidth, kHeight});
    cpu::plan_weights(plan, fixed, 3);
    const cpu::PageBuffer scratch(kernels.scratch_bytes, "the test");
    constexpr float kUntouched = 123;
    Image image(kWidth, kHeight, kUntouched);
    cpu::CastJob job =
        cpu::cast_job(make_ray_frame(named_.volume.grid, view.geometry, {}), {kWidth, kHeight}, named_.volume.grid);
    for (int axis = 0; axis < 3; ++axis) job.layouts[axis] = layouts.view(axis);
    job.step_mm = 0.5;
    job.needed = plan.needed.data();
    job.needed_stride = plan.needed_stride;
    job.image = image.pixels.data();
    job.image_stride = kWidth;
    job.scratch = scratch.data();
    job.y1 = cpu::kTilePx;
    for (job.x0 = 0; job.x0 < 2 * cpu::kTilePx; job.x0 += cpu::kTilePx) {
        job.x1 = job.x0 + cpu::kTilePx;
        (projector == Projector::joseph ? kernels.cast_joseph : kernels.cast_trilinear)[storage](job);
    }
    const auto touched = [&](int x, int y) { return image(x, y) != kUntouched; };
    for (int y = 0; y < cpu::kTilePx; ++y) {
        for (int x = 0; x < 2 * cpu::kTilePx; ++x) {
            // Squares of kNeedPx pixels are cast as one.
            const bool first = x < 12 && y < 12, second = x >= 24 && x < 36 && y >= 28;
            ASSERT_EQ(touched(x, y), first || second) << x << ", " << y;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, CpuMask,
                         testing::Combine(testing::ValuesIn(available_sets()),
                                          testing::Values(Projector::joseph, Projector::trilinear),
                                          testing::Values("float32", "int16")),
                         [](const testing::TestParamInfo<MaskCase>& test) {
                             return std::get<0>(test.param) + "_" +
                                    std::string(projector_name(std::get<1>(test.param))) + "_" +
                                    std::get<2>(test.param);
                         });

}  // namespace
}  // namespace raylign::detail::test

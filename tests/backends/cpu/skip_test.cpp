// Leaving out empty space, in memory and along rays, changes no bit of an image or of a derivative.
#include <algorithm>
#include <cstring>

#include "backends/cpu/frame_plan.h"
#include "backends/cpu/kernel_dispatch.h"
#include "backends/cpu/volume_layouts.h"
#include "cpu_scenes.h"

namespace raylign::detail::test {
namespace {

constexpr int kSide = 32, kImages = 1 + cpu::kParameters;

class CpuSkip : public testing::TestWithParam<std::tuple<std::string, cpu::VoxelStorage>> {
protected:
    /// A random volume with air in it and around it: the box is smaller than the volume on all sides.
    CpuSkip() : volume_(random_volume({90, 95, 85}, {1, 1, 1}, 4, 0.93)) {
        for (int z = 0; z < 85; ++z) {
            for (int y = 0; y < 95; ++y) {
                for (int x = 0; x < 90; ++x) {
                    const bool inside = x > 17 && x < 66 && y > 18 && y < 70 && z > 16 && z < 60;
                    if (!inside) volume_.attenuation_per_mm[volume_.index(x, y, z)] = 0;
                }
            }
        }
    }
    [[nodiscard]] std::vector<float> cast(const cpu::VolumeLayouts& layouts, const View& view, Projector projector) {
        const auto& [set, storage] = GetParam();
        const cpu::KernelTable& kernels = cpu::choose_kernels(instruction_set_from_name(set));
        const cpu::PageBuffer scratch(kernels.scratch_bytes, "the test");
        const Eigen::Vector2i size_px(kSide, kSide);
        const cpu::FrameDerivatives derivatives = cpu::frame_derivatives(
            make_ray_frame_derivatives(volume_.grid, view.geometry, {}, Eigen::Vector3d::Zero()));
        std::vector<float> images(kImages * kSide * kSide);
        cpu::CastJob job = cpu::cast_job(make_ray_frame(volume_.grid, view.geometry, {}), size_px, volume_.grid);
        for (int axis = 0; axis < 3; ++axis) job.layouts[axis] = layouts.view(axis);
        job.step_mm = 0.5;
        job.x1 = job.y1 = job.image_stride = kSide;
        job.image_distance = kSide * kSide;
        job.image = images.data();
        job.scratch = scratch.data();
        job.derivatives = &derivatives;
        const bool joseph = projector == Projector::joseph;
        (joseph ? kernels.cast_joseph_derivatives : kernels.cast_trilinear_derivatives)[storage](job);
        std::vector<float> value(kSide * kSide);
        job.image = value.data();
        (joseph ? kernels.cast_joseph : kernels.cast_trilinear)[storage](job);
        images.insert(images.end(), value.begin(), value.end());
        return images;
    }

    Volume volume_;
};

TEST_P(CpuSkip, EmptySpaceChangesNoBit) {
    const cpu::VoxelStorage storage = std::get<1>(GetParam());
    cpu::Workers workers(1);
    const int size[3] = {90, 95, 85};
    const cpu::VoxelSource source{
        volume_.attenuation_per_mm.data(), cpu::kFloat32, 1, {1, 90, 90 * 95}, {0, 0, 0}, {90, 95, 85}};
    const cpu::BrickMap map = cpu::map_bricks(volume_.attenuation_per_mm.data(), size, workers);
    cpu::VolumeLayouts lean(source, map, storage, 0, workers);
    cpu::VolumeLayouts full(source, cpu::all_occupied(map), storage, 0, workers);
    for (int axis = 1; axis < 3; ++axis) {
        lean.make(axis, workers);
        full.make(axis, workers);
    }
    ASSERT_LT(lean.view(2).end[0] - lean.view(2).begin[0], 60);
    ASSERT_EQ(full.view(2).end[0] - full.view(2).begin[0], 85);
    const Eigen::Matrix3d towards[] = {rotation(11, 7, 30),  rotation(191, 7, 30), rotation(80, 10, 5),
                                       rotation(-80, 10, 5), rotation(5, 85, 0),   rotation(5, -85, 0)};
    for (const Eigen::Matrix3d& direction : towards) {
        for (const double pitch_mm : {0.7, 1.5, 4.5}) {
            const View view = view_along(direction, {kSide, kSide}, pitch_mm);
            for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
                const std::vector<float> a = cast(lean, view, projector), b = cast(full, view, projector);
                EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(float)), 0)
                    << projector_name(projector) << " " << pitch_mm;
                EXPECT_GT(*std::ranges::max_element(b), 0);
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, CpuSkip,
                         testing::Combine(testing::ValuesIn(available_sets()),
                                          testing::Values(cpu::kFloat32, cpu::kInt16)),
                         [](const testing::TestParamInfo<std::tuple<std::string, cpu::VoxelStorage>>& test) {
                             return std::get<0>(test.param) +
                                    (std::get<1>(test.param) == cpu::kInt16 ? "_int16" : "_float32");
                         });

}  // namespace
}  // namespace raylign::detail::test

// Skipping empty space changes no bit of an image.
#include <algorithm>
#include <cstring>

#include "backends/cpu/frame_plan.h"
#include "backends/cpu/kernel_dispatch.h"
#include "backends/cpu/volume_layout.h"
#include "cpu_scenes.h"

namespace raylign::test {
namespace {

class CpuSkip : public testing::TestWithParam<std::string> {};

TEST_P(CpuSkip, EmptySpaceChangesNoBit) {
    const cpu::KernelTable& kernels = cpu::choose_kernels(GetParam());
    const Volume volume = random_volume({70, 75, 65}, {1, 1, 1}, 4, 0.93);
    cpu::Workers workers(1);
    const cpu::VolumeLayout::Source source{
        volume.attenuation_per_mm.data(), cpu::kFloat32, 1, {1, 70, 70 * 75}, {70, 75, 65}};
    const cpu::VolumeLayout layout(source, 2, cpu::kFloat32, workers);
    // The same voxels with every block said to be occupied.
    cpu::PlaneLayout full = layout.view();
    const int slabs = (full.planes + cpu::kSlabPlanes - 1) / cpu::kSlabPlanes;
    std::vector<std::int32_t> table;
    for (int slab = 0; slab < slabs; ++slab) {
        for (int row = 0; row <= full.block_rows; ++row) {
            for (int column = 0; column <= full.block_columns; ++column) table.push_back(row * column);
        }
    }
    full.occupied = table.data();

    const cpu::PageBuffer scratch(kernels.scratch_bytes, "the test");
    const Eigen::Vector2i size_px(32, 32);
    for (const double pitch_mm : {0.7, 1.5, 4.5}) {
        const View view = view_along(rotation(11, 7, 30), size_px, pitch_mm);
        cpu::CastJob job = cpu::cast_job(make_ray_frame(volume.grid, view.geometry, {}), size_px, volume.grid);
        job.step_mm = 0.5;
        job.x1 = job.y1 = 32;
        job.image_stride = 32;
        job.scratch = scratch.data();
        for (const auto cast : {kernels.cast_joseph[cpu::kFloat32], kernels.cast_trilinear[cpu::kFloat32]}) {
            Image skipped(32, 32), complete(32, 32);
            job.layouts[2] = layout.view();
            job.image = skipped.pixels.data();
            cast(job);
            job.layouts[2] = full;
            job.image = complete.pixels.data();
            cast(job);
            EXPECT_EQ(std::memcmp(skipped.pixels.data(), complete.pixels.data(), 32 * 32 * sizeof(float)), 0)
                << pitch_mm;
            EXPECT_GT(*std::ranges::max_element(complete.pixels), 0);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, CpuSkip, testing::ValuesIn(available_sets()),
                         [](const testing::TestParamInfo<std::string>& test) { return test.param; });

}  // namespace
}  // namespace raylign::test

// How much memory the backend takes, and what it does where a volume is too large for it.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "backends/cpu/frame_plan.h"
#include "backends/cpu/kernel_dispatch.h"
#include "core/base/error.h"
#include "cpu_scenes.h"
#include "layout_scene.h"
#include "tests/support/errors.h"

namespace raylign::detail::test {
namespace {

constexpr double kMiB = 0x1p20;
constexpr cpu::StorageRule kDefault{.max_bytes = static_cast<double>(CpuOptions{}.max_volume_bytes)};

TEST(CpuMemory, ALargeVolumeIsStoredAsInt16AndASmallOneAsFloat32) {
    EXPECT_EQ(cpu::choose_storage(cpu::dense_map(512, 512, 1000), kDefault), cpu::kInt16);
    EXPECT_EQ(cpu::choose_storage(cpu::dense_map(512, 512, 512), kDefault), cpu::kFloat32);
    EXPECT_EQ(cpu::choose_storage(cpu::dense_map(64, 64, 64), {.wanted = cpu::kInt16, .max_bytes = 1e12}), cpu::kInt16);
    EXPECT_EQ(cpu::choose_storage(cpu::dense_map(512, 512, 1000), {.wanted = cpu::kFloat32}), cpu::kFloat32);
    EXPECT_EQ(cpu::choose_storage(cpu::dense_map(1, 1, 1), {.max_bytes = 0}), cpu::kInt16);
    const cpu::StorageRule short_first{.max_bytes = kDefault.max_bytes, .preferred = cpu::kInt16};
    EXPECT_EQ(cpu::choose_storage(cpu::dense_map(1, 1, 1), short_first), cpu::kInt16);
}

TEST(CpuMemory, AThousandSlicesOf512SquaredStayBelowFourGiB) {
    const cpu::BrickMap map = cpu::dense_map(512, 512, 1000);
    const double host = 4.0 * 512 * 512 * 1000, backend = cpu::layout_bytes(map, cpu::choose_storage(map, kDefault));
    EXPECT_LT(backend, 1100 * kMiB) << "two copies, two bytes a voxel";
    // The next level of the pyramid may be there at the same time, an eighth of both.
    EXPECT_LT(1.125 * (host + backend), 0.75 * 4096 * kMiB) << "leaves a quarter for all else";
}

/// Two blobs in opposite corners: the box is the whole volume, and nearly all of it is empty.
Volume two_blobs() {
    Volume volume;
    volume.grid.size = {256, 256, 240};
    volume.attenuation_per_mm.assign(volume.grid.voxel_count(), 0.F);
    for (int z = 0; z < 20; ++z) {
        for (int y = 0; y < 20; ++y) {
            for (int x = 0; x < 20; ++x) {
                volume.attenuation_per_mm[volume.index(x, y, z)] = 0.02F;
                volume.attenuation_per_mm[volume.index(255 - x, 255 - y, 239 - z)] = 0.01F;
            }
        }
    }
    return volume;
}

/// Pages of the process that are in memory [bytes].
double resident_bytes() {
    std::ifstream statm("/proc/self/statm");
    double all = 0, resident = 0;
    statm >> all >> resident;
    return 4096 * resident;
}

TEST(CpuMemory, EmptyBricksTakeNoMemory) {
    const Volume volume = two_blobs();
    cpu::Workers workers(2);
    const double before = resident_bytes();
    cpu::VolumeLayouts layouts = cpu::make_layouts(volume, kDefault, 0, workers);
    layouts.make(1, workers);
    const double span = 2 * 4.0 * 256 * 256 * 240;
    EXPECT_LT(layouts.bytes(), 0.3 * span);
    EXPECT_LT(resident_bytes() - before, 0.35 * span) << "the system's own count";
}

TEST(CpuMemory, AnObjectInACornerOfItsVolumeTakesTheMemoryOfTheObject) {
    Volume volume = random_volume({200, 200, 200}, {1, 1, 1}, 3);
    for (int z = 0; z < 200; ++z) {
        for (int y = 0; y < 200; ++y) {
            for (int x = 0; x < 200; ++x) {
                if (x < 130 || y < 140 || z > 60) volume.attenuation_per_mm[volume.index(x, y, z)] = 0;
            }
        }
    }
    cpu::Workers workers(2);
    const cpu::VolumeLayouts layouts = cpu::make_layouts(volume, kDefault, 2, workers);
    EXPECT_LT(layouts.bytes(), 4.0 * (72 + 24) * (72 + 24) * (64 + 24) + 3e5);
}

cpu::VoxelStorage preferred_storage(const std::string& set) {
    return cpu::choose_kernels(instruction_set_from_name(set)).storage;
}

TEST(CpuMemory, TheLimitOfAutomaticStorageIsAnOption) {
    const NamedScene named{
        "limit", random_volume({64, 64, 64}, {1, 1, 1}, 1), {view_along(rotation(0, 0, 0), {9, 9}, 2)}};
    const std::vector<std::string> sets = available_sets();
    const auto prefers_floats = std::ranges::find(sets, cpu::kFloat32, preferred_storage);
    if (prefers_floats == sets.end()) GTEST_SKIP() << "int16 is fastest with every instruction set here";
    const auto layout = [&](CpuOptions options) {
        options.instruction_set = instruction_set_from_name(*prefers_floats);
        return make_cpu_backend(options)->prepare(named.scene(Projector::joseph))->volume_layout();
    };
    EXPECT_THAT(layout({}), testing::StartsWith("float32, 1 copy"));
    EXPECT_THAT(layout({.max_volume_bytes = 1 << 20}), testing::StartsWith("int16"));
    EXPECT_THAT(layout({.storage = Storage::float32, .max_volume_bytes = 1 << 20}), testing::StartsWith("float32"));
}

/// int16 is faster with all but SSE2: bench/README.md, Memory.
TEST(CpuMemory, KernelsThatTakeInt16FasterKeepItByThemselvesAndFloat32WhereAsked) {
    const NamedScene named{
        "short", random_volume({64, 64, 64}, {1, 1, 1}, 1), {view_along(rotation(0, 0, 0), {9, 9}, 2)}};
    for (const std::string& set : available_sets()) {
        CpuOptions options{.instruction_set = instruction_set_from_name(set)};
        const auto layout = [&] {
            return make_cpu_backend(options)->prepare(named.scene(Projector::joseph))->volume_layout();
        };
        EXPECT_THAT(layout(), testing::StartsWith(set == "sse2" ? "float32" : "int16")) << set;
        options.storage = Storage::float32;
        EXPECT_THAT(layout(), testing::StartsWith("float32")) << set;
    }
}

TEST(CpuMemory, TwoToThe31VoxelsAreCountedRightAndRefusedWhereTheyDoNotFit) {
    const cpu::BrickMap map = cpu::dense_map(2048, 1024, 1024);
    // Three copies, since offsets of 32 bits do not reach from one z to the next.
    EXPECT_NEAR(cpu::layout_bytes(map, cpu::kInt16), 3 * 2.0 * 2048 * 1024 * 1024, 0.1 * 3 * 2.0 * 0x1p31);
    if (cpu::layout_bytes(map, cpu::kFloat32) < static_cast<double>(cpu::free_memory())) GTEST_SKIP() << "it fits here";
    cpu::Workers workers(1);
    EXPECT_THAT(error_of([&] { const cpu::VolumeLayouts layouts({}, map, cpu::kFloat32, 2, workers); }),
                testing::AllOf(testing::HasSubstr("int16: half of it"), testing::HasSubstr("MiB are free")));
}

/// An occupied cube in the last corner of 2^31 voxels: only its pages are written, so that the test needs addresses,
/// not memory. Every axis and instruction set must find it there.
class CpuBeyond32Bits : public testing::TestWithParam<std::string> {};

TEST_P(CpuBeyond32Bits, VoxelsFarApartAreFound) {
    constexpr int kSize[3] = {2048, 1024, 1032}, kCorner[3] = {1984, 960, 968};
    if (cpu::free_memory() < 3U * 2 * 1200 * static_cast<std::size_t>(kMiB) * 2) GTEST_SKIP() << "too little memory";
    const Volume cube = random_volume({64, 64, 64}, {1, 1, 1}, 9, 0.3);
    cpu::BrickMap map = cpu::dense_map(kSize[0], kSize[1], kSize[2]);
    map.occupied.assign(map.index(0, 0, map.bricks[2]), 0);
    for (int i = 0; i < 512; ++i) {
        map.occupied[map.index(kCorner[0] / 8 + i % 8, kCorner[1] / 8 + i / 8 % 8, kCorner[2] / 8 + i / 64)] = 1;
    }
    map.largest = 0.04F;
    const cpu::VoxelSource source{
        cube.attenuation_per_mm.data(), cpu::kFloat32, 1, {1, 64, 64 * 64}, {kCorner[0], kCorner[1], kCorner[2]},
        {kSize[0], kSize[1], kSize[2]}};
    cpu::Workers workers(2);
    const cpu::KernelTable& kernels = cpu::choose_kernels(instruction_set_from_name(GetParam()));
    const cpu::PageBuffer scratch(kernels.scratch_bytes, "the test");
    cpu::VolumeLayouts layouts(source, map, cpu::kInt16, 0, workers);
    for (int axis = 1; axis < 3; ++axis) layouts.make(axis, workers);

    const Eigen::Matrix3d views[] = {rotation(20, 70, 10), rotation(75, 15, 30), rotation(11, 7, 30)};
    for (const Eigen::Matrix3d& direction : views) {
        NamedScene small{"cube", cube, {view_along(direction, {32, 32}, 2.5)}};
        for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
            const Image truth = make_reference_backend()->prepare(small.scene(projector))->render({}, 0);
            cpu::CastJob job =
                cpu::cast_job(make_ray_frame(cube.grid, small.views[0].geometry, {}), {32, 32}, cube.grid);
            Image image(32, 32);
            for (int axis = 0; axis < 3; ++axis) {
                job.source[axis] += kCorner[axis];
                job.layouts[axis] = layouts.view(axis);
            }
            job.step_mm = 0.5;
            job.x1 = job.y1 = 32;
            job.image = image.pixels.data();
            job.image_stride = 32;
            job.scratch = scratch.data();
            (projector == Projector::joseph ? kernels.cast_joseph : kernels.cast_trilinear)[cpu::kInt16](job);
            const float maximum = *std::ranges::max_element(truth.pixels);
            for (std::size_t i = 0; i < truth.pixels.size(); ++i) {
                ASSERT_NEAR(image.pixels[i], truth.pixels[i], 5e-5 * maximum) << projector_name(projector) << " " << i;
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, CpuBeyond32Bits, testing::ValuesIn(available_sets()),
                         [](const testing::TestParamInfo<std::string>& test) { return test.param; });

}  // namespace
}  // namespace raylign::detail::test

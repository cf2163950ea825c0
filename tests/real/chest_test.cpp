// The main job on a real chest CT with simulated X-rays: another projector and a finer step than the registration's,
// photon noise. bench/starts.cpp prints the same for any number of seeds.

#include <gtest/gtest.h>

#include "core/validation/tolerances.h"
#include "raylign/io/volume.h"
#include "raylign/registration.h"
#include "raylign/simulate.h"
#include "raylign/targets.h"
#include "tests/support/backends.h"
#include "tests/support/scenes.h"
#include "tests/support/test_data.h"
#include "tests/support/tolerances.h"

namespace raylign::detail {
namespace {

constexpr double kField_mm = 400;  // the chest is wider: the images cut it, as real ones do

std::filesystem::path chest_path() { return test::test_data() / "chest" / "lidc-0314-half.nii.gz"; }

struct ChestCase {
    explicit ChestCase(int side_px) : volume(read_volume(chest_path()).volume) {
        truth = test::oblique_pose() * RigidTransform::translate(-volume.grid.centre_ct_mm());
        targets = default_targets_ct_mm(volume);
        views = test::biplane_views(side_px, kField_mm);
        const auto simulator = create_backend("cpu").backend;  // floats, whatever filters the X-rays' DRRs
        const auto session = simulator->prepare({volume, views, {Projector::trilinear, 0.6}, {}});
        for (std::size_t v = 0; v < views.size(); ++v) {
            views[v].image = with_photon_noise(session->render(truth, v), 20000, 100 + v);
        }
    }
    [[nodiscard]] double mtre_mm(const RigidTransform& pose) const {
        return mean_target_error_mm(pose, truth, targets);
    }
    [[nodiscard]] double half_voxel_mm() const { return volume.grid.spacing_mm.minCoeff() / 2; }

    Volume volume;
    std::vector<View> views;
    RigidTransform truth;
    std::vector<Eigen::Vector3d> targets;
};

class ChestStart : public testing::TestWithParam<int> {};

TEST_P(ChestStart, BiplaneEndsBelowHalfAVoxelFromEightMillimetres) {
    RAYLIGN_NEED_DATA(chest_path());
    RAYLIGN_MAKE_BACKEND(backend, "cpu");
    const ChestCase chest(256);
    const RigidTransform start = perturbed_start(chest.truth, chest.targets, 8, GetParam());
    ASSERT_NEAR(chest.mtre_mm(start), 8, 1e-6);
    const RegistrationResult result = register_volume(chest.volume, chest.views, start, {}, *backend);
    EXPECT_TRUE(result.ok);
    EXPECT_LT(chest.mtre_mm(result.world_from_ct), chest.half_voxel_mm());
    EXPECT_LT(chest.mtre_mm(result.world_from_ct), test::kChestMtre_mm) << "no less accurate than it was";
}
INSTANTIATE_TEST_SUITE_P(Seeds, ChestStart, testing::Values(1, 2, 3));

TEST(Chest, CpuAndReferenceEndAtTheSamePoseBelowHalfAVoxel) {
    RAYLIGN_NEED_DATA(chest_path());
    RAYLIGN_MAKE_BACKEND(cpu, "cpu");
    RAYLIGN_MAKE_BACKEND(reference, "reference");
    const ChestCase chest(48);  // the reference is slow
    const RigidTransform start = perturbed_start(chest.truth, chest.targets, 8, 1);
    const RegistrationResult fast = register_volume(chest.volume, chest.views, start, {}, *cpu);
    const RegistrationResult slow = register_volume(chest.volume, chest.views, start, {}, *reference);
    // At 48 pixels 0.514 and 0.518 mm were reached: three times that is more than success asks for.
    EXPECT_LT(chest.mtre_mm(slow.world_from_ct), chest.half_voxel_mm());
    EXPECT_LT(chest.mtre_mm(fast.world_from_ct), chest.half_voxel_mm());
    EXPECT_LT(mean_target_error_mm(fast.world_from_ct, slow.world_from_ct, chest.targets), test::kPoseMtre_mm);
    EXPECT_NEAR(fast.cost_final, slow.cost_final, test::kCost);
}

TEST(Chest, GlEndsAtThePoseOfCpu) {
    RAYLIGN_NEED_DATA(chest_path());
    RAYLIGN_MAKE_BACKEND(cpu, "cpu");
    RAYLIGN_MAKE_BACKEND(gl, "gl");
    const ChestCase chest(96);  // software OpenGL is slow
    const RigidTransform start = perturbed_start(chest.truth, chest.targets, 8, 1);
    const RegistrationResult on_cpu = register_volume(chest.volume, chest.views, start, {}, *cpu);
    const RegistrationResult on_gl = register_volume(chest.volume, chest.views, start, {}, *gl);
    EXPECT_LT(mean_target_error_mm(on_gl.world_from_ct, on_cpu.world_from_ct, chest.targets), test::kPoseMtre_mm);
    EXPECT_NEAR(on_gl.cost_final, on_cpu.cost_final, test::kCost);
}

TEST(Chest, TextureFiltersAndInt16VoxelsMoveThePoseLittle) {
    RAYLIGN_NEED_DATA(chest_path());
    RAYLIGN_MAKE_BACKEND(exact, "gl");
    const ChestCase chest(96);
    const RigidTransform start = perturbed_start(chest.truth, chest.targets, 8, 1);
    const auto filtered = create_backend("gl").backend;  // as it is without options
    const RegistrationResult a = register_volume(chest.volume, chest.views, start, {}, *exact);
    const RegistrationResult b = register_volume(chest.volume, chest.views, start, {}, *filtered);
    EXPECT_LT(mean_target_error_mm(b.world_from_ct, a.world_from_ct, chest.targets), kFilterBitsPoseMtre_mm);
}

}  // namespace
}  // namespace raylign::detail

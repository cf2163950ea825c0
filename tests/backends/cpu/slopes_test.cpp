// Derivatives where rays are special: parallel to an axis, exactly on voxel planes, or nowhere near the volume.
#include <algorithm>

#include "cpu_scenes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail::test {
namespace {

/// Attenuation that is affine in the voxel: its interpolant has no kinks inside, so it has a slope on voxel planes too.
Volume affine_volume() {
    Volume volume = random_volume({33, 33, 33}, {1, 1, 1}, 1);
    for (int z = 0; z < 33; ++z) {
        for (int y = 0; y < 33; ++y) {
            for (int x = 0; x < 33; ++x) {
                volume.attenuation_per_mm[volume.index(x, y, z)] = 0.04F + 1.2e-3F * static_cast<float>(x) -
                                                                   8e-4F * static_cast<float>(y) +
                                                                   4e-4F * static_cast<float>(z);
            }
        }
    }
    return volume;
}

using SlopeCase = std::tuple<std::string, Projector, std::string>;

class CpuSlopes : public testing::TestWithParam<SlopeCase> {
protected:
    [[nodiscard]] Linearization ours(const NamedScene& named, const RigidTransform& pose) const {
        const auto& [set, projector, storage] = GetParam();
        return linearize(*make_cpu_backend({.threads = 2,
                                            .instruction_set = instruction_set_from_name(set),
                                            .storage = storage_from_name(storage)}),
                         named, pose);
    }
    [[nodiscard]] static Linearization linearize(Backend& backend, const NamedScene& named,
                                                 const RigidTransform& pose) {
        Linearization result;
        backend.prepare(named.scene(std::get<1>(GetParam()), {Metric::ncc, {}}))
            ->linearize({&pose, 1}, {2, -3, 1}, {&result, 1});
        return result;
    }
};

TEST_P(CpuSlopes, AreThoseOfTheReferenceForRaysAlongAnAxisAndOnVoxelPlanes) {
    const Eigen::Matrix3d towards[] = {rotation(0, 0, 0),   rotation(180, 0, 0), rotation(0, 90, 0),
                                       rotation(0, -90, 0), rotation(90, 0, 0),  rotation(-90, 0, 0)};
    for (const Eigen::Matrix3d& direction : towards) {
        // The middle pixel's ray is the axis x = y = 16 voxels; none comes near the volume's sides.
        NamedScene named{"planes", affine_volume(), {view_along(direction.array().round(), {23, 21}, 1.5)}};
        add_images(named, pose_near_identity(7, 0.1));
        for (const double shift_mm : {0.0, 1.0, 0.5}) {
            const RigidTransform pose = RigidTransform::translate(Eigen::Vector3d::Constant(shift_mm));
            const Linearization found = ours(named, pose), truth = linearize(*make_reference_backend(), named, pose);
            // Far above 1e-5: of an affine image little is left of the gradient, the rest cancels in the correlation.
            const double share = std::get<2>(GetParam()) == "int16" ? 1e-3 : 3e-4;
            EXPECT_NEAR(found.cost, truth.cost, kCost);
            EXPECT_LT((found.gradient - truth.gradient).norm(), share * truth.gradient.norm())
                << found.gradient.transpose() << "\n"
                << truth.gradient.transpose() << "\n"
                << direction;
            EXPECT_LT((found.curvature - truth.curvature).norm(), share * truth.curvature.norm());
        }
    }
}

TEST_P(CpuSlopes, OfAVolumeThatNoRayMeetsAreZeroAndItCostsOne) {
    NamedScene named{
        "missed", random_volume({20, 20, 20}, {1, 1, 1}, 9), {view_along(rotation(20, 30, 10), {40, 33}, 1.5)}};
    add_images(named, {});
    for (const Eigen::Vector3d& away_mm :
         {Eigen::Vector3d(500, 0, 0), Eigen::Vector3d(3000, -4000, 5000), Eigen::Vector3d(-1e8, 1e8, 1e8)}) {
        const Linearization found = ours(named, RigidTransform::translate(away_mm));
        EXPECT_EQ(found.cost, 1) << away_mm.transpose();
        EXPECT_EQ(found.gradient, Twist(Twist::Zero()));
        EXPECT_TRUE(found.curvature.isZero(0));
    }
}

TEST_P(CpuSlopes, OfAnEmptyVolumeAreZeroAndItCostsOne) {
    NamedScene named{
        "empty", random_volume({20, 9, 31}, {1, 1, 1}, 9), {view_along(rotation(20, 30, 10), {40, 33}, 1.5)}};
    add_images(named, {});
    for (const float air : {0.F, -0.F}) {
        std::ranges::fill(named.volume.attenuation_per_mm, air);
        const Linearization found = ours(named, pose_near_identity(3));
        EXPECT_EQ(found.cost, 1);
        EXPECT_EQ(found.gradient, Twist(Twist::Zero()));
    }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, CpuSlopes,
                         testing::Combine(testing::ValuesIn(available_sets()),
                                          testing::Values(Projector::joseph, Projector::trilinear),
                                          testing::Values("float32", "int16")),
                         [](const testing::TestParamInfo<SlopeCase>& test) {
                             return std::get<0>(test.param) + "_" +
                                    std::string(projector_name(std::get<1>(test.param))) + "_" +
                                    std::get<2>(test.param);
                         });

}  // namespace
}  // namespace raylign::detail::test

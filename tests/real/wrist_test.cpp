// Real biplane X-rays of a wrist and the CT of one of its bones: other bones, hand and soft tissue lie over the radius.
// The reference poses come from another program and are no gold standard: over its restarts the bone's centre moved by
// up to 0.15 mm and the rotation by up to 1.4 degrees (SOURCE.md beside the data).

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/evaluation/targets.h"
#include "core/io/views_io.h"
#include "core/io/volume_io.h"
#include "core/registration/registration.h"
#include "tests/support/backends.h"
#include "tests/support/test_data.h"

namespace raylign {
namespace {

std::filesystem::path wrist() { return test::test_data() / "wrist"; }

Volume radius() {
    VolumeReadOptions options;
    options.spacing_mm = Eigen::Vector3d(0.39625, 0.39625, 0.625);
    options.hu_offset = -1024;
    return read_volume(wrist() / "rad_dcm_cropped.tif", options).volume;
}

std::vector<View> xrays(const std::string& instant) {
    std::vector<std::string> arguments;
    for (const std::string camera : {"cam01", "cam02"}) {
        arguments.push_back((wrist() / ("xr_calib_wrist_" + camera + ".txt")).string() + "=" +
                            (wrist() / ("xr_rad_uln_" + camera + "_UND." + instant + ".tif")).string());
    }
    return read_views(arguments, ViewsReadOptions{.auto_mask = true}).views;
}

/// x_world = R ((column, row, slice) .* spacing - middle) + t.
RigidTransform reference_pose(int instant, const VoxelGrid& grid) {
    std::ifstream file(wrist() / "reference_poses.json");
    for (const auto& entry : nlohmann::json::parse(file)) {
        if (entry["frame"] != instant) continue;
        RigidTransform pose;
        for (int r = 0; r < 3; ++r) {
            for (int c = 0; c < 3; ++c) pose.rotation(r, c) = entry["R"][r][c];
            pose.translation_mm[r] = entry["t"][r];
        }
        return pose * RigidTransform::translate(-grid.centre_ct_mm());
    }
    throw std::runtime_error("no such instant");
}

class Wrist : public testing::TestWithParam<int> {};

TEST_P(Wrist, RadiusIsFoundUnderTheOtherBones) {
    RAYLIGN_NEED_DATA(wrist());
    RAYLIGN_MAKE_BACKEND(backend, "cpu");
    const int instant = GetParam();
    const Volume bone = radius();
    const RigidTransform reference = reference_pose(instant, bone.grid);
    const auto targets = default_targets_ct_mm(bone);
    const RigidTransform start = perturbed_start(reference, targets, 9, instant);
    const RegistrationResult found = register_volume(bone, xrays(instant == 2 ? "0002" : "0099"), start, {}, *backend);
    EXPECT_EQ(found.content, Content::part);
    EXPECT_TRUE(found.ok) << found.reasons.front();
    const Eigen::Vector3d centre = bone.grid.centre_ct_mm();
    EXPECT_LT((found.world_from_ct * centre - reference * centre).norm(), 0.5);
    EXPECT_LT(rotation_angle_rad(found.world_from_ct * inverse(reference)) * 180 / std::numbers::pi, 2);
}
INSTANTIATE_TEST_SUITE_P(Instants, Wrist, testing::Values(2, 99));

}  // namespace
}  // namespace raylign

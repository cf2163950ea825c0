// A camera that is believed one degree off, on X-rays with scatter, hardening and blur: noticed, and right ones
// believed.

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "raylign/intensity.h"
#include "raylign/io/volume.h"
#include "raylign/registration.h"
#include "raylign/targets.h"
#include "raylign/xray.h"
#include "tests/support/backends.h"
#include "tests/support/scenes.h"
#include "tests/support/test_data.h"
#include "tests/support/xrays.h"

namespace raylign::detail {
namespace {

std::filesystem::path ct_path() { return test::test_data() / "chest" / "lidc-0314-half.nii.gz"; }

/// The chest at another pose for every seed, 256^2 pixels of the model c-arm.
struct CArmCase {
    explicit CArmCase(int seed) {
        Twist twist;
        twist << 0.03 * seed, -0.05 * seed, 0.04, 6, -3 * seed, 4;
        truth = exp(twist) * test::oblique_pose() * RigidTransform::translate(-volume.grid.centre_ct_mm());
        const XrayModel& model = xray_model("c-arm");
        const auto exposures = expose(model, volume, hu_presets().front(), views, truth, *backend);
        for (std::size_t v = 0; v < views.size(); ++v) {
            test::take_counts(views[v], detected(model, exposures[v], 10 * seed + v));
        }
    }
    /// The second camera is believed turned by one degree about an oblique axis through the isocentre.
    void mistake_a_camera() {
        Twist off = Twist::Zero();
        off.head<3>() = std::numbers::pi / 180 * Eigen::Vector3d(1, -1, 1).normalized();
        RigidTransform& camera_from_world = views[1].geometry.camera_from_world;
        camera_from_world = camera_from_world * exp(off);
    }
    [[nodiscard]] RegistrationResult run(const RegistrationOptions& options = {}) const {
        return register_volume(volume, views, perturbed_start(truth, targets, 5, 1), options, *backend);
    }
    [[nodiscard]] double mtre_mm(const RegistrationResult& result) const {
        return mean_target_error_mm(result.world_from_ct, truth, targets);
    }

    Volume volume = read_volume(ct_path()).volume;
    std::vector<View> views = test::biplane_views(256, 400);
    std::vector<Eigen::Vector3d> targets = default_targets_ct_mm(volume);
    RigidTransform truth;
    std::unique_ptr<Backend> backend = create_backend("cpu").backend;
};

class WrongCamera : public testing::TestWithParam<int> {};

TEST_P(WrongCamera, RightOnesAreBelieved) {
    RAYLIGN_NEED_DATA(ct_path());
    const CArmCase c(GetParam());
    const RegistrationResult result = c.run();
    EXPECT_TRUE(result.ok) << (result.ok ? "" : result.reasons.front());
    EXPECT_LT(c.mtre_mm(result), 2 * result.confidence.rim_mm);
}

TEST_P(WrongCamera, OneDegreeIsNoticedThoughFarMoreIsUnexplained) {
    RAYLIGN_NEED_DATA(ct_path());
    CArmCase c(GetParam());
    c.mistake_a_camera();
    const RegistrationResult result = c.run();
    EXPECT_GT(c.mtre_mm(result), 0.5) << "then it would not matter";
    EXPECT_FALSE(result.ok);
    EXPECT_THAT(result.reasons, testing::Contains(testing::HasSubstr("the views contradict each other")));
    for (const ViewResult& view : result.views) {  // which of the two is wrong nobody can tell
        EXPECT_NEAR(view.correction.rotation_deg.norm(), 1, 0.6) << view.correction.rotation_deg.transpose();
    }
}

class RefinedCamera : public testing::TestWithParam<int> {};

TEST_P(RefinedCamera, KnowsHowFarItMayBeOff) {
    RAYLIGN_NEED_DATA(ct_path());
    CArmCase c(GetParam());
    c.mistake_a_camera();
    RegistrationOptions options;
    options.refine_views = ViewPrior{.rotation_deg = 2, .translation_mm = 10, .kept_view = 0};
    const RegistrationResult result = c.run(options);
    EXPECT_TRUE(result.ok) << (result.ok ? "" : result.reasons.front());
    EXPECT_LT(c.mtre_mm(result), 1.1) << "eight poses: 0.46 to 1.05 mm where 0.82 to 1.96 was expected";
    EXPECT_LT(c.mtre_mm(result), 2 * result.confidence.rim_mm);
    const ViewCorrection& found = result.views[1].correction;
    const Eigen::Vector3d off_deg = found.rotation_deg - Eigen::Vector3d(1, -1, 1).normalized();
    for (int i = 0; i < 3; ++i) EXPECT_LT(std::abs(off_deg[i]), 4 * found.rotation_sigma_deg[i]) << off_deg.transpose();
}
INSTANTIATE_TEST_SUITE_P(Poses, WrongCamera, testing::Values(1, 2));
INSTANTIATE_TEST_SUITE_P(Poses, RefinedCamera, testing::Values(2, 3));

}  // namespace
}  // namespace raylign::detail

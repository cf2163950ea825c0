// Cameras that are not where the views say: what the verdict says of them, and what refine_views finds.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/registration/object/pose_space.h"
#include "raylign/backends.h"
#include "raylign/registration.h"
#include "raylign/targets.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

Volume rig_volume() {
    return voxelise(spine_phantom({160, 160, 160}), centred_grid({128, 128, 128}, {1.25, 1.25, 1.25}), 1);
}

/// The spine of 1.25 mm voxels in views of 128 x 128 pixels; noise of 10^5 photons. The X-rays are made with the true
/// cameras, by the other projector or exactly; then one may be turned and moved about the object's centre, and that is
/// what the views say.
struct RigCase {
    explicit RigCase(std::uint64_t seed = 1, std::vector<double> angles_deg = {0, 90}, bool exact = false) {
        for (const double angle_deg : angles_deg) {
            views.push_back(
                {"V" + std::to_string(static_cast<int>(angle_deg)), test::c_arm_view(angle_deg, 128), {}, {}});
        }
        const auto session = backend->prepare({volume, views, {Projector::trilinear, 0.5}, {}});
        for (std::size_t v = 0; v < views.size(); ++v) {
            const Image image =
                exact ? exact_drr(spine_phantom({160, 160, 160}), views[v].geometry, truth) : session->render(truth, v);
            views[v].image = with_photon_noise(image, 1e5, 100 * seed + v);
        }
        start = perturbed_start(truth, targets, 6, seed);
    }
    /// The camera must be moved by this to be right.
    void believe_elsewhere(std::size_t view, const Twist& off) {
        RigidTransform& camera_from_world = views[view].geometry.camera_from_world;
        camera_from_world = camera_from_world * exp_about(off, truth * object_extent(volume).centre_ct_mm);
    }
    [[nodiscard]] RegistrationResult run(const RegistrationOptions& options = {}) const {
        return register_volume(volume, views, start, options, *backend);
    }
    [[nodiscard]] double mtre_mm(const RegistrationResult& result) const {
        return mean_target_error_mm(result.world_from_ct, truth, targets);
    }

    Volume volume = rig_volume();
    RigidTransform truth = test::oblique_pose(), start;
    std::vector<View> views;
    std::vector<Eigen::Vector3d> targets = default_targets_ct_mm(volume);
    std::unique_ptr<Backend> backend = create_backend("cpu").backend;
};

RegistrationOptions refining(double prior_deg = 2, double prior_mm = 10) {
    RegistrationOptions options;
    options.refine_views = ViewPrior{prior_deg, prior_mm, 0};
    return options;
}

Twist twist(double x_deg, double y_deg, double z_deg, double x_mm, double y_mm, double z_mm) {
    Twist off;
    off << x_deg * kDegree, y_deg * kDegree, z_deg * kDegree, x_mm, y_mm, z_mm;
    return off;
}

/// Root mean square over the six numbers of how many sigmas the correction is off; sigma at least of 0.03 degrees and
/// 0.1 mm, a twentieth of a voxel, which is what 2.5 mm voxels leave.
double off_in_sigmas(const ViewCorrection& found, const Twist& truth) {
    double squared = 0;
    for (int i = 0; i < 3; ++i) {
        squared +=
            std::pow((found.rotation_deg[i] - truth[i] / kDegree) / std::max(found.rotation_sigma_deg[i], 0.03), 2);
        squared += std::pow((found.translation_mm[i] - truth[i + 3]) / std::max(found.translation_sigma_mm[i], 0.1), 2);
    }
    return std::sqrt(squared / 6);
}

TEST(ViewAgreement, RightCamerasAreNotDoubted) {
    // Exact X-rays: voxels displace edges, which puts the spine off in the depth of each view alone.
    for (const bool exact : {false, true}) {
        for (std::uint64_t seed = 1; seed <= 2; ++seed) {
            const RegistrationResult result = RigCase(seed, {0, 90}, exact).run();
            EXPECT_TRUE(result.ok) << "seed " << seed << ": " << (result.ok ? "" : result.reasons.front());
            ASSERT_EQ(result.views.size(), 2u);
            for (const ViewResult& view : result.views) {
                EXPECT_TRUE(view.correction.is_estimated);
                EXPECT_FALSE(view.correction.is_doubtful);
                EXPECT_LT(view.correction.significance, 2) << "exact " << exact << ", seed " << seed;
            }
        }
    }
}

TEST(ViewAgreement, TwoViewsWantTheOpposite) {
    RigCase c;
    c.believe_elsewhere(1, twist(0.2, 0.3, -0.2, 0, 0, -0.3));
    const RegistrationResult result = c.run();
    const ViewCorrection &a = result.views[0].correction, &b = result.views[1].correction;
    EXPECT_LT(a.rotation_deg.dot(b.rotation_deg), -0.5 * a.rotation_deg.norm() * b.rotation_deg.norm());
    EXPECT_LT(a.translation_mm.dot(b.translation_mm), 0);
}

TEST(ViewAgreement, AWrongCameraIsNamedWithItsCorrection) {
    for (const double degrees : {2.0, 3.0}) {
        RigCase c;
        const Twist off = twist(degrees, 0, 0, 0, 0, 0);
        c.believe_elsewhere(1, off);
        const RegistrationResult result = c.run();
        const ViewCorrection& found = result.views[1].correction;
        EXPECT_FALSE(result.ok) << degrees << ": significance " << found.significance << ", effect " << found.effect_mm
                                << " mm, expected " << result.confidence.rim_mm << " mm, is " << c.mtre_mm(result);
        EXPECT_THAT(result.reasons,
                    testing::Contains(testing::AllOf(testing::HasSubstr("fits best"), testing::HasSubstr("degrees"))))
            << degrees;
        EXPECT_TRUE(result.views[1].correction.is_doubtful);
        EXPECT_NEAR(result.views[1].correction.rotation_deg.x(), degrees, 0.15 * degrees + 0.1);
        EXPECT_TRUE(result.confidence.is_withheld) << "how sure a doubted pose is nobody needs to know";
    }
}

TEST(ViewAgreement, OfThreeViewsTheWrongOneIsNamed) {
    RigCase c(1, {0, 90, 45});
    c.believe_elsewhere(1, twist(1, 0, 0, 0, 0, 0));
    const RegistrationResult result = c.run();
    EXPECT_THAT(result.reasons, testing::Contains(testing::HasSubstr("V90 fits best")))
        << result.views[0].correction.significance << " " << result.views[1].correction.significance << " "
        << result.views[2].correction.significance << " eff " << result.views[1].correction.effect_mm << " rim "
        << result.confidence.rim_mm;
}

TEST(ViewAgreement, OneViewHasNoOther) {
    RigCase c(1, {0});
    const RegistrationResult result = c.run();
    ASSERT_EQ(result.views.size(), 1u);
    EXPECT_FALSE(result.views[0].correction.is_estimated);
}

TEST(ViewAgreement, IsLeftOutWhereItIsNotAskedFor) {
    RigCase c;
    c.believe_elsewhere(1, twist(0, 0, 1, 0, 0, 0));
    RegistrationOptions options;
    options.compare_views = false;
    const RegistrationResult result = c.run(options);
    EXPECT_FALSE(result.views[1].correction.is_estimated);
    EXPECT_THAT(result.reasons, testing::Not(testing::Contains(testing::HasSubstr("contradict"))));
}

TEST(RefineViews, FindsThePlantedErrorsAndThePose) {
    for (const Twist& off : {twist(0.5, -0.6, 0.6, 0, 0, 0), twist(2, -1, 2, 0, 0, 0), twist(0, 0, 0, 1, -1, 1.4),
                             twist(0, 0, 0, 2, -10, 12)}) {
        RigCase c;
        c.believe_elsewhere(1, off);
        const double believed_mm = c.mtre_mm(c.run());
        const RegistrationResult result = c.run(refining());
        EXPECT_LT(off_in_sigmas(result.views[1].correction, off), 2.5) << off.transpose();
        EXPECT_LT(c.mtre_mm(result), 0.5) << off.transpose();
        EXPECT_LT(c.mtre_mm(result), believed_mm) << off.transpose();
        EXPECT_FALSE(result.views[0].correction.is_estimated) << "it stays";
        EXPECT_TRUE(result.views[1].correction.is_applied);
    }
}

TEST(RefineViews, LeavesRightCamerasWhereTheyAre) {
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
        const RegistrationResult result = RigCase(seed).run(refining());
        EXPECT_LT(off_in_sigmas(result.views[1].correction, Twist::Zero()), 2.5);
    }
}

TEST(RefineViews, TellsTheCamerasThatThePoseBelongsTo) {
    RigCase c;
    const RigidTransform right = c.views[1].geometry.camera_from_world;
    c.believe_elsewhere(1, twist(0, 1, 0, 0, 3, 0));
    const RegistrationResult result = c.run(refining());
    EXPECT_EQ(to_matrix(result.views[0].camera_from_world), to_matrix(c.views[0].geometry.camera_from_world));
    EXPECT_LT(rotation_angle_rad(result.views[1].camera_from_world * inverse(right)), 0.1 * kDegree);
}

TEST(RefineViews, SharesTheCorrectionsOutWhereNoViewIsKept) {
    RigCase c;
    c.believe_elsewhere(1, twist(0, 0, 1, 0, 0, 0));
    RegistrationOptions options = refining();
    options.refine_views->kept_view.reset();
    const RegistrationResult result = c.run(options);
    const double first_deg = result.views[0].correction.rotation_deg.z();
    const double second_deg = result.views[1].correction.rotation_deg.z();
    EXPECT_NEAR(first_deg, -second_deg, 0.05) << "half each of what the prior lets the slim spine tell";
    EXPECT_GT(second_deg, 0.15);
    EXPECT_LT(second_deg, 0.6);
    EXPECT_GT(result.confidence.rotation_deg, 1) << "two degrees of prior each leave the rig as a whole open";
}

TEST(RefineViews, ATightPriorHoldsTheCameras) {
    RigCase c;
    c.believe_elsewhere(1, twist(0, 0, 1, 0, 0, 0));
    const RegistrationResult loose = c.run(refining()), tight = c.run(refining(1e-4, 1e-3));
    EXPECT_LT(tight.views[1].correction.rotation_deg.norm(), 0.1 * loose.views[1].correction.rotation_deg.norm());
}

TEST(RefineViews, ACorrectionThatRunsAwayIsDoubted) {
    RigCase c;
    c.believe_elsewhere(1, twist(0, 0, 0, 0, 0, 6));
    const RegistrationResult result = c.run(refining(1, 0.5));
    EXPECT_FALSE(result.ok);
    EXPECT_TRUE(result.views[1].correction.is_doubtful);
    EXPECT_THAT(result.reasons, testing::Contains(testing::HasSubstr("far more than it may be off")));
}

TEST(RefineViews, RefusesWhatCannotBe) {
    const auto message = [](const RigCase& c, const RegistrationOptions& options) {
        try {
            (void)c.run(options);
            return std::string("none");
        } catch (const Error& error) {
            return std::string(error.what());
        }
    };
    RegistrationOptions options = refining();
    EXPECT_THAT(message(RigCase(1, {0}), options), testing::HasSubstr("one view cannot tell"));
    options.method = Method::bobyqa;
    EXPECT_THAT(message(RigCase(), options), testing::HasSubstr("needs gauss-newton"));
    options = refining();
    options.time_limit_s = 5;
    EXPECT_THAT(message(RigCase(), options), testing::HasSubstr("time limit"));
    EXPECT_THAT(message(RigCase(), refining(0, 10)), testing::HasSubstr("view prior = 0 degrees"));
    EXPECT_THAT(message(RigCase(), refining(2, 1000)), testing::HasSubstr("view prior = 1000 mm"));
    EXPECT_THAT(message(RigCase(), refining(std::nan(""), 1)), testing::HasSubstr("view prior = nan degrees"));
    options = refining();
    options.refine_views->kept_view = 2;
    EXPECT_THAT(message(RigCase(), options), testing::HasSubstr("kept view = 2: must be below 2"));
}

TEST(RefineViews, TheSameInputGivesTheSameBits) {
    RigCase c;
    c.believe_elsewhere(1, twist(0, 0, 1, 0, 0, 0));
    const RegistrationResult a = c.run(refining()), b = c.run(refining());
    EXPECT_EQ(to_matrix(a.world_from_ct), to_matrix(b.world_from_ct));
    EXPECT_EQ(a.views[1].correction.rotation_deg, b.views[1].correction.rotation_deg);
}

TEST(RefineViews, CountsAllItsWork) {
    RigCase c;
    RegistrationOptions options = refining();
    options.look_around = false;  // what it does is counted, and is on no level
    const RegistrationResult result = c.run(options);
    std::uint64_t linearizations = 0;
    for (const LevelReport& level : result.levels) linearizations += level.linearizations;
    EXPECT_EQ(result.counters.linearizations, linearizations);
    EXPECT_EQ(result.start_world_from_ct.translation_mm, c.start.translation_mm);
}

}  // namespace
}  // namespace raylign::detail

// One view of a vertebra: contrast that is compressed makes it look larger, which is depth.

#include "core/registration/trust/response.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/linear_algebra.h"
#include "core/image/region.h"
#include "raylign/backends.h"
#include "raylign/phantom.h"
#include "raylign/registration.h"
#include "raylign/targets.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

const Eigen::Vector3d kPhantom_mm(200, 200, 200);

Image hardened(Image drr, float h) {
    for (float& pixel : drr.pixels) pixel /= 1 + h * pixel;
    return drr;
}

/// What a detector shows that adds `share` of the open beam to every pixel, as glare and a black level do.
Image veiled(Image integral, double share) {
    for (float& pixel : integral.pixels) {
        pixel = static_cast<float>(-std::log((std::exp(-pixel) + share) / (1 + share)));
    }
    return integral;
}

/// The third of five vertebrae.
struct OneVertebra {
    OneVertebra() {
        const Volume whole =
            voxelise(spine_vertebra(kPhantom_mm, 2), centred_grid({160, 160, 160}, {1.25, 1.25, 1.25}), 2);
        volume = crop(whole, box_of_object(whole));
        views.resize(1);
    }
    [[nodiscard]] ViewSums sums() const {
        const auto session = backend->prepare({volume, views, {}, {Metric::gc, {1.5, 5}}});
        return pose_sums(
                   *session, {}, volume.grid.centre_ct_mm(), [] {}, response_derivative)
            .front();
    }
    /// In its own DRR behind 15 cm of water, which no edge shows, from 4 mm off.
    [[nodiscard]] RegistrationResult found(double veil) {
        Image all = backend->prepare({volume, views, {}, {}})->render({}, 0);
        for (float& pixel : all.pixels) pixel += 3;
        views[0].image = veiled(all, veil);
        views[0].image = with_photon_noise(views[0].image, 1e8, 7);
        return register_volume(volume, views, RigidTransform::translate({2, 3, -2}), {.content = Content::part},
                               *backend);
    }
    [[nodiscard]] double error_mm(const RegistrationResult& result) const {
        return mean_target_error_mm(result.world_from_ct, {}, default_targets_ct_mm(volume));
    }

    Volume volume;
    std::vector<View> views = test::biplane_views(256, 220);
    std::unique_ptr<Backend> backend = create_backend("cpu").backend;
};

}  // namespace

TEST(Response, DerivativeIsTheLimitOfHardening) {
    Image drr(2, 2);
    drr.pixels = {0, 0.5F, 1, 3};
    const Image derivative = response_derivative(drr, 0);
    constexpr float kStep = 1e-3F;
    for (std::size_t p = 0; p < 4; ++p) {
        const float difference = (hardened(drr, kStep).pixels[p] - hardened(drr, -kStep).pixels[p]) / (2 * kStep);
        EXPECT_NEAR(derivative.pixels[p], difference, 1e-3);
    }
}

TEST(Response, ShiftIsTheStepOfAPoseThatIgnoresIt) {
    OneVertebra c;
    const Image drr = c.backend->prepare({c.volume, c.views, {}, {}})->render({}, 0);
    c.views[0].image = drr;
    const ViewSums straight = c.sums();
    EXPECT_LT(response_shift(straight).twist.norm(), 1e-3);
    c.views[0].image = hardened(drr, 0.02F);
    const ViewSums sums = c.sums();
    const Twist step = -solve_symmetric(sums.all.curvature, sums.all.gradient);
    EXPECT_GT(step.norm(), 0.05);
    EXPECT_LT((response_shift(sums).twist - step).norm(), 0.1 * step.norm()) << "linear in h but for h^2";
}

TEST(Response, WidensWhatIsExpectedWhereTheXrayShowsIt) {
    OneVertebra c;
    const RegistrationResult straight = c.found(0), veiled = c.found(0.02);  // 1 in 20 comes through
    ASSERT_TRUE(straight.confidence.is_estimated && veiled.confidence.is_estimated);
    EXPECT_LT(c.error_mm(straight), 2 * straight.confidence.rim_mm);
    EXPECT_GT(c.error_mm(veiled), 1);
    EXPECT_LT(c.error_mm(veiled), 2 * veiled.confidence.rim_mm);
    EXPECT_GT(veiled.confidence.in_depth_mm, 2 * straight.confidence.in_depth_mm) << "1.1 times without the response";
}

}  // namespace raylign::detail

// One view of a vertebra: contrast that is compressed makes it look larger, which is depth.

#include "core/registration/trust/response.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/image/region.h"
#include "raylign/backends.h"
#include "raylign/phantom.h"
#include "raylign/registration.h"
#include "raylign/targets.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

const Eigen::Vector3d kPhantom_mm(200, 200, 200);

/// What shows of line integrals under a floor f.
Image floored(Image integral, double floor) {
    for (float& pixel : integral.pixels) {
        pixel = static_cast<float>(-std::log(floor + (1 - floor) * std::exp(-static_cast<double>(pixel))));
    }
    return integral;
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
    /// Where the DRR shows this floor, which is taken for the X-ray's, too, but for `more`.
    [[nodiscard]] ViewSums sums(double floor, double more) {
        views[0].ceiling = std::numeric_limits<double>::infinity();
        const auto plain = backend->prepare({volume, views, {}, {}});
        views[0].image = floored(plain->render({}, 0), floor + more);
        views[0].ceiling = -std::log(floor);
        const auto session = backend->prepare({volume, views, {}, {Metric::gc, {1.5, 5}}});
        const auto derivative = [floor](const Image& shown, std::size_t) { return floor_derivative(shown, floor); };
        return pose_sums(
                   *session, {}, volume.grid.centre_ct_mm(), [] {}, derivative)
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

TEST(Response, DerivativeIsTheLimitOfDifferences) {
    Image integral(2, 2);
    integral.pixels = {0, 0.5F, 1, 3};
    constexpr double kStep = 1e-3;
    for (const double floor : {0.0, 0.2, 0.9}) {
        const Image derivative = floor_derivative(floored(integral, floor), floor);
        for (std::size_t p = 0; p < 4; ++p) {
            const float difference =
                floored(integral, floor + kStep).pixels[p] - floored(integral, floor - kStep).pixels[p];
            EXPECT_NEAR(derivative.pixels[p], difference / (2 * kStep), 1e-3 * (1 + std::abs(derivative.pixels[p])));
        }
    }
}

TEST(Response, DerivativeIsFiniteBehindWhatNothingGetsThrough) {
    Image dense(1, 1);
    dense.pixels = {1000};
    EXPECT_TRUE(std::isfinite(floor_derivative(dense, 0.5).pixels[0]));
}

TEST(Response, StepIsTheFloorThatIsMissing) {
    OneVertebra c;
    EXPECT_NEAR(floor_step(c.sums(0.3, 0)), 0, 1e-5);
    EXPECT_NEAR(floor_step(c.sums(0.3, 0.01)), 0.01, 1e-3);
    EXPECT_NEAR(floor_step(c.sums(0.3, -0.01)), -0.01, 1e-3);
}

TEST(Response, DepthIsFoundThoughTheXrayCompressesContrast) {
    OneVertebra c;
    const RegistrationResult straight = c.found(0);
    EXPECT_LT(c.error_mm(straight), 2 * straight.confidence.rim_mm);
    EXPECT_EQ(straight.confidence.is_estimated, true);
    for (const double veil : {0.02, 0.1}) {  // 1 in 20 comes through: up to twice as much comes from elsewhere
        const RegistrationResult veiled = c.found(veil);
        ASSERT_TRUE(veiled.confidence.is_estimated);
        EXPECT_LT(c.error_mm(veiled), 0.5) << veil;
        EXPECT_LT(c.error_mm(veiled), 2 * veiled.confidence.rim_mm) << veil;
        EXPECT_THAT(veiled.decisions, testing::Contains(testing::HasSubstr("fitted beside the pose")));
    }
}

TEST(Response, ACeilingThatIsGivenIsKept) {
    OneVertebra c;
    c.views[0].ceiling = 5;
    EXPECT_THAT(c.found(0.02).decisions, testing::Not(testing::Contains(testing::HasSubstr("fitted beside the pose"))));
}

}  // namespace raylign::detail

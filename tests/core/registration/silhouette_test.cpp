// Metal so dense that each view shows nothing but where it is: every pixel of it has one and the same count.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/image/region.h"
#include "core/image/saturation.h"
#include "core/registration/object/pose_space.h"
#include "raylign/backends.h"
#include "raylign/phantom.h"
#include "raylign/registration.h"
#include "raylign/targets.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

constexpr int kSide_px = 128;
constexpr float kFloor = 64, kLargest = 255;  // counts
constexpr double kDenser = 20;                // than bone: 4 mm of it let a tenth through
constexpr int kStarts = 3;

/// A vertebra of metal in soft tissue, 8 bits, pixels of 1.25 mm at the object, voxels of two thirds of that.
struct Silhouettes {
    Silhouettes() {
        const Volume whole = voxelise(vertebra, centred_grid({192, 192, 192}, Eigen::Vector3d::Constant(0.833)), 2);
        volume = crop(whole, box_of_object(whole));
        for (float& value : volume.attenuation_per_mm) value *= static_cast<float>(kDenser);
        targets = default_targets_ct_mm(volume);
        for (View& view : views) expose(view);
    }
    void expose(View& view) {
        view.image = exact_drr(vertebra, view.geometry, truth);
        for (int y = 0; y < kSide_px; ++y) {
            for (int x = 0; x < kSide_px; ++x) {
                const double tissue = 0.15 + 0.2 * x / kSide_px + 0.05 * std::sin(0.2 * y);
                const double arriving = std::exp(-kDenser * view.image(x, y) - tissue);
                const float count = std::max(kFloor, std::round(kLargest * static_cast<float>(arriving)));
                metal += view.image(x, y) > 0;
                flat += count == kFloor;
                view.image(x, y) = -std::log(count / kLargest);
            }
        }
        const auto saturation = find_saturation(view.image, {});
        view.ceiling = saturation ? saturation->ceiling : std::numeric_limits<double>::infinity();
        view.by_transmission = true;  // as the program compares metal
    }
    [[nodiscard]] RegistrationResult from_start(std::uint64_t seed, std::span<const View> seen) const {
        RegistrationOptions options;
        options.content = Content::part;
        return register_volume(volume, seen, perturbed_start(truth, targets, 8, seed), options, *choice.backend);
    }

    Phantom vertebra = spine_vertebra(Eigen::Vector3d::Constant(160), 2);
    RigidTransform truth = test::oblique_pose();
    std::vector<View> views = test::biplane_views(kSide_px, 160);
    Volume volume;
    std::vector<Eigen::Vector3d> targets;
    BackendChoice choice = create_backend("cpu");
    int metal = 0, flat = 0;  ///< pixels
};

TEST(Silhouettes, HaveNothingInsideAndTheirCeilingIsFound) {
    const Silhouettes scene;
    EXPECT_GT(scene.flat, 0.8 * scene.metal) << "but for a rim of a pixel, a seventh of it";
    for (const View& view : scene.views) EXPECT_EQ(view.ceiling, -std::log(kFloor / kLargest));
}

TEST(Silhouettes, InTwoViewsTellThePose) {
    const Silhouettes scene;
    for (std::uint64_t seed = 1; seed <= kStarts; ++seed) {
        const RegistrationResult found = scene.from_start(seed, scene.views);
        EXPECT_TRUE(found.ok) << seed << (found.reasons.empty() ? "" : found.reasons.front());
        const double off_mm = mean_target_error_mm(found.world_from_ct, scene.truth, scene.targets);
        EXPECT_LT(off_mm, 0.25) << "a fifth of a pixel; start " << seed;
        EXPECT_LT(off_mm, 2 * found.confidence.rim_mm) << seed;
    }
}

TEST(Silhouettes, AreNotWhatADrrThatDoesNotSaturateShows) {
    const Silhouettes scene;
    std::vector<View> open = scene.views;
    for (View& view : open) {
        view.ceiling = std::numeric_limits<double>::infinity();
        view.by_transmission = false;
    }
    const auto off_mm = [&](std::span<const View> views) {
        return mean_target_error_mm(scene.from_start(1, views).world_from_ct, scene.truth, scene.targets);
    };
    EXPECT_GT(off_mm(open), 3 * off_mm(scene.views));
}

TEST(Silhouettes, InOneViewTellAllButDepthWhichIsExpected) {
    const Silhouettes scene;
    const View& view = scene.views.front();
    const Eigen::Vector3d centre_ct_mm = object_extent(scene.volume).centre_ct_mm;
    const Eigen::Vector3d sight = (scene.truth * centre_ct_mm - source_world_mm(view.geometry)).normalized();
    for (std::uint64_t seed = 1; seed <= kStarts; ++seed) {
        const RegistrationResult found = scene.from_start(seed, {&view, 1});
        EXPECT_TRUE(found.ok) << seed << (found.reasons.empty() ? "" : found.reasons.front());
        const Eigen::Vector3d off_mm = found.world_from_ct * centre_ct_mm - scene.truth * centre_ct_mm;
        const double depth_mm = off_mm.dot(sight);
        EXPECT_LT((off_mm - depth_mm * sight).norm(), 0.25) << seed;
        EXPECT_LT(std::abs(depth_mm), 2 * found.confidence.in_depth_mm) << seed;
    }
}

}  // namespace
}  // namespace raylign::detail

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/registration/object/resident_volume.h"
#include "core/registration/trust/mirrored.h"
#include "raylign/backends.h"
#include "raylign/registration.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// Solids that no turn makes their own mirror image.
Phantom lopsided() {
    Phantom phantom{"lopsided", {}};
    const auto at = [](double x, double y, double z) { return RigidTransform::translate({x, y, z}); };
    phantom.solids.push_back(Box{at(-20, 10, 0), {14, 10, 40}, 0.03});
    phantom.solids.push_back(Box{at(8, -12, 22), {22, 8, 8}, 0.03});
    phantom.solids.push_back(Ellipsoid{at(25, 16, -24), {10, 14, 12}, 0.03});
    phantom.solids.push_back(Box{at(0, -20, -30), {6, 12, 9}, 0.04});
    return phantom;
}

struct MirrorCase {
    MirrorCase() { views = test::with_exact_images(test::biplane_views(64), lopsided(), truth, 1e6); }
    std::optional<std::string> suspicion() {
        const RegistrationResult found = register_volume(volume, views, truth, {}, *backend);
        for (const std::string& reason : found.reasons) {
            if (reason.find("reversed the images fit far better") != std::string::npos) return reason;
        }
        return std::nullopt;
    }
    RigidTransform truth = test::oblique_pose();
    Volume volume = voxelise(lopsided(), centred_grid({64, 64, 64}, {2, 2, 2}), 3);
    std::vector<View> views;
    std::unique_ptr<Backend> backend = create_backend("cpu").backend;
};

TEST(Mirrored, ReversingColumnsTwiceChangesNothing) {
    MirrorCase c;
    View& view = c.views[0];
    view.weights = Image(64, 64, 1);
    view.weights(3, 5) = 0;
    const View once = with_columns_reversed(view), twice = with_columns_reversed(once);
    EXPECT_EQ(once.weights(60, 5), 0);
    EXPECT_EQ(once.image(0, 7), view.image(63, 7));
    EXPECT_EQ(twice.image.pixels, view.image.pixels);
    EXPECT_EQ(twice.weights.pixels, view.weights.pixels);
}

TEST(Mirrored, AMaskThatHidesTheMirroredObjectIsNoError) {
    MirrorCase c;
    const RigidTransform aside = RigidTransform::translate({70, 70, 0}) * c.truth;
    const auto session = c.backend->prepare({c.volume, c.views, {}, {}});
    for (std::size_t v = 0; v < c.views.size(); ++v) {
        const Image drr = session->render(aside, v);
        double left = 0, right = 0;
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 64; ++x) (x < 32 ? left : right) += drr(x, y);
        // Only the object's half counts, and nothing there looks like it.
        c.views[v].weights = Image(64, 64, 0);
        for (int y = 0; y < 64; ++y) {
            for (int x = 0; x < 64; ++x) {
                c.views[v].weights(x, y) = (x < 32) == (left > right) ? 1 : 0;
                c.views[v].image(x, y) = static_cast<float>(x * y % 9);
            }
        }
    }
    const RegistrationResult found = register_volume(c.volume, c.views, aside, {.content = Content::whole}, *c.backend);
    EXPECT_FALSE(found.ok) << "and so the mirrored images were tried";
}

TEST(Mirrored, NamesTheViewThatFitsReversed) {
    MirrorCase c;
    c.views[0] = with_columns_reversed(c.views[0]);
    const auto suspicion = c.suspicion();
    ASSERT_TRUE(suspicion);
    EXPECT_THAT(*suspicion, AllOf(HasSubstr("columns of AP reversed"), Not(HasSubstr("LAT")), HasSubstr("flip")));
}

TEST(Mirrored, NamesBothViewsWhereBothAre) {
    MirrorCase c;
    for (View& view : c.views) view = with_columns_reversed(view);
    const auto suspicion = c.suspicion();
    ASSERT_TRUE(suspicion);
    EXPECT_THAT(*suspicion, HasSubstr("columns of AP, LAT reversed"));
}

TEST(Mirrored, IsNotSuspectedOfGoodResults) {
    MirrorCase c;
    EXPECT_FALSE(c.suspicion());
}

TEST(Mirrored, IsNotSuspectedOfUnrelatedImages) {
    MirrorCase c;
    c.views = test::with_exact_images(test::biplane_views(64), ellipsoid_phantom({90, 120, 100}), c.truth, 1e6);
    EXPECT_FALSE(c.suspicion());
}

TEST(Mirrored, IsNotLookedIntoWhereTheCallerDoesNotWant) {
    MirrorCase c;
    c.views[0] = with_columns_reversed(c.views[0]);
    const auto reasons = [&](const RegistrationOptions& options) {
        return register_volume(c.volume, c.views, c.truth, options, *c.backend).reasons;
    };
    EXPECT_THAT(reasons({}), testing::Contains(HasSubstr("reversed the images")));
    EXPECT_THAT(reasons({.suspect_mirrored = false}), Not(testing::Contains(HasSubstr("reversed the images"))));
}

}  // namespace
}  // namespace raylign::detail

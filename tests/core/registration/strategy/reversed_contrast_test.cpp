#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "raylign/backends.h"
#include "raylign/registration.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

/// An ellipsoid with a box in it.
Phantom body() {
    Phantom phantom{"body", {}};
    phantom.solids.push_back(Ellipsoid{RigidTransform::translate({0, 0, 0}), {40, 30, 45}, 0.02});
    phantom.solids.push_back(Box{RigidTransform::translate({8, 5, -6}), {12, 9, 20}, 0.03});
    return phantom;
}

struct ContrastCase {
    explicit ContrastCase(int size_px = 64) {
        views = test::with_exact_images(test::biplane_views(size_px), body(), truth, 1e6);
    }
    RegistrationResult found() { return register_volume(volume, views, start, {}, *backend); }
    void reverse(std::size_t view) {
        for (float& pixel : views[view].image.pixels) pixel = 3 - pixel;
    }
    RigidTransform truth = test::oblique_pose(), start = RigidTransform::translate({3, -2, 2}) * truth;
    Volume volume = voxelise(body(), centred_grid({64, 64, 64}, {2, 2, 2}), 3);
    std::vector<View> views;
    std::unique_ptr<Backend> backend = create_backend("cpu").backend;
};

TEST(ReversedContrast, IsNamedBeforeAPartIsSought) {
    ContrastCase c;
    c.reverse(0);
    c.reverse(1);
    const RegistrationResult result = c.found();
    EXPECT_FALSE(result.ok);
    EXPECT_THAT(result.reasons.front(), HasSubstr("with the contrast of all views reversed"));
    EXPECT_EQ(result.content, Content::whole);
}

/// Two levels: the coarsest one already ends the run, and nothing else would doubt it.
TEST(ReversedContrast, IsADoubtWhereTheCoarsestLevelIsHopeless) {
    ContrastCase c(128);
    c.reverse(0);
    c.reverse(1);
    const RegistrationResult result = c.found();
    EXPECT_EQ(result.levels.size(), 1U);
    EXPECT_FALSE(result.ok);
    EXPECT_THAT(result.reasons.front(), HasSubstr("with the contrast of all views reversed"));
}

TEST(ReversedContrast, OfOneViewIsNamed) {
    ContrastCase c;
    c.reverse(1);
    EXPECT_THAT(c.found().reasons, Contains(HasSubstr("with the contrast of view " + c.views[1].name + " reversed")));
}

TEST(ReversedContrast, IsNotSuspectedOfRightAndOfUnrelatedImages) {
    ContrastCase c;
    EXPECT_TRUE(c.found().ok);
    c.views = test::with_exact_images(test::biplane_views(64), ellipsoid_phantom({90, 120, 100}), c.truth, 1e6);
    EXPECT_THAT(c.found().reasons, Not(Contains(HasSubstr("contrast of"))));
}

}  // namespace
}  // namespace raylign::detail

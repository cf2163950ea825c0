#include <gtest/gtest.h>

#include <limits>

#include "core/base/error.h"
#include "core/image/pyramid.h"
#include "core/registration/object/resident_volume.h"
#include "core/registration/registration.h"
#include "raylign/backends.h"
#include "raylign/targets.h"
#include "tests/support/errors.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

struct Scene64 {
    Volume volume = test::spine_volume(32);
    RigidTransform truth = test::oblique_pose();
    std::vector<View> views =
        test::with_exact_images(test::biplane_views(64), spine_phantom({160, 160, 160}), truth, 2000);
    RigidTransform start = perturbed_start(truth, default_targets_ct_mm(volume), 6, 1);
    BackendChoice choice = create_backend("cpu");
};

TEST(ResidentVolume, RegisteringOnItTwiceGivesTheBitsOfTwoRuns) {
    Scene64 s;
    ResidentVolume resident(s.volume, {}, *s.choice.backend);
    for (const Content content : {Content::whole, Content::part}) {
        RegistrationOptions options;
        options.content = content;
        options.search.mode = Search::none;
        const RegistrationResult alone = register_volume(s.volume, s.views, s.start, options, *s.choice.backend);
        const RegistrationResult shared = register_resident(resident, s.views, s.start, options);
        EXPECT_EQ(to_matrix(shared.world_from_ct), to_matrix(alone.world_from_ct));
        EXPECT_EQ(shared.cost_final, alone.cost_final);
        EXPECT_EQ(shared.counters.linearizations, alone.counters.linearizations);
    }
}

TEST(ResidentVolume, IsHalvedOnceAndMadeResidentOnce) {
    Scene64 s;
    ResidentVolume resident(s.volume, {}, *s.choice.backend);
    const Volume twice = half_resolution(half_resolution(s.volume));
    EXPECT_EQ(resident.halved(2).attenuation_per_mm, twice.attenuation_per_mm);
    EXPECT_EQ(&resident.halved(2), &resident.halved(2));
    EXPECT_EQ(&resident.halved(0), &s.volume);
    const auto first = resident.session(1, s.views, {});
    EXPECT_GT(resident.take_prepare_s(), 0);
    const auto second = resident.session(1, s.views, {});
    EXPECT_EQ(resident.take_prepare_s(), 0);
    EXPECT_EQ(first->render(s.truth, 1).pixels, second->render(s.truth, 1).pixels);
}

TEST(ResidentVolume, AStepThatSuitsTheVolumeSuitsItsHalves) {
    Scene64 s;
    const RenderSettings fine{Projector::trilinear, 0.012 * s.volume.grid.spacing_mm.minCoeff()};
    ResidentVolume resident(s.volume, fine, *s.choice.backend);
    const auto whole = resident.session(0, s.views, {}), quarter = resident.session(2, s.views, {});
    double a = 0, b = 0;
    whole->evaluate({&s.truth, 1}, {&a, 1});
    quarter->evaluate({&s.truth, 1}, {&b, 1});
    EXPECT_NEAR(a, b, 0.3);
}

TEST(ResidentVolume, OtherRenderSettingsAndBadVolumesAreRefused) {
    Scene64 s;
    ResidentVolume resident(s.volume, {}, *s.choice.backend);
    EXPECT_THROW((void)register_resident(resident, s.views, s.start, {.render = {Projector::trilinear, {}}}), Error);
    EXPECT_THROW(ResidentVolume(s.volume, {Projector::trilinear, -1}, *s.choice.backend), Error);
    Volume empty = s.volume;
    for (float& value : empty.attenuation_per_mm) value = 0;
    EXPECT_THROW(ResidentVolume(empty, {}, *s.choice.backend), Error);
    Volume broken = s.volume;
    broken.attenuation_per_mm[broken.index(3, 2, 1)] = std::numeric_limits<float>::quiet_NaN();
    const std::string why = test::error_of([&] { (void)ResidentVolume(broken, {}, *s.choice.backend); });
    EXPECT_NE(why.find("voxel (3, 2, 1)"), std::string::npos) << why;
    broken.attenuation_per_mm.pop_back();
    EXPECT_THROW(ResidentVolume(broken, {}, *s.choice.backend), Error);
}

}  // namespace
}  // namespace raylign::detail

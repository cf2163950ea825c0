// Two vertebrae at their right places in exact X-rays, and what is said of each.

#include "core/registration/scene/scene_judgement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <deque>

#include "core/image/region.h"
#include "raylign/backends.h"
#include "raylign/phantom.h"
#include "raylign/targets.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

using testing::Contains;
using testing::HasSubstr;

const Eigen::Vector3d kSpine_mm(200, 200, 200);

Volume lone_vertebra(int level) {
    const Volume whole = voxelise(spine_vertebra(kSpine_mm, level), centred_grid({100, 100, 100}, {2, 2, 2}), 2);
    return crop(whole, box_of_object(whole));
}

/// The second and third vertebra, nothing else, all where they are in the CT.
struct TwoVertebrae {
    TwoVertebrae() {
        views = test::biplane_views(128, 220);
        for (View& view : views) {
            view.image = exact_drr(spine_vertebra(kSpine_mm, 1), view.geometry, {});
            const Image other = exact_drr(spine_vertebra(kSpine_mm, 2), view.geometry, {});
            for (std::size_t p = 0; p < other.pixels.size(); ++p) view.image.pixels[p] += other.pixels[p];
            view.image = with_photon_noise(view.image, 1e5, 7);
        }
        for (const Volume& volume : volumes) resident.emplace_back(volume, RenderSettings{}, *backend);
        for (std::size_t k = 0; k < volumes.size(); ++k) {
            scene.volumes.push_back(&resident[k]);
            scene.moving.push_back(k);
        }
        scene.guides = scene.moving;
        scene.starts_world_from_ct = scene.world_from_ct = {{}, {}};
    }
    [[nodiscard]] std::vector<SceneObject> objects() const { return {{"L4", volumes[0], {}}, {"L3", volumes[1], {}}}; }
    void take_xrays() { scene.views = views; }
    [[nodiscard]] double error_mm(std::size_t k, const RigidTransform& world_from_ct) const {
        return mean_target_error_mm(world_from_ct, {}, default_targets_ct_mm(volumes[k]));
    }
    /// All judged, but of the first a search is made to have ended elsewhere.
    SceneResult judged_with_a_stray(double cost_initial, double cost_final) {
        take_xrays();
        finish_together(scene);
        SceneResult result;
        judge_all(scene, objects(), result);
        RegistrationResult& stray = result.objects[0];
        stray.world_from_ct = RigidTransform::translate({0, 12, 0});
        stray.search.mode = Search::near;
        stray.cost_initial = cost_initial;
        stray.cost_final = cost_final;
        stay_with_the_scene(scene, objects(), result);
        return result;
    }

    std::unique_ptr<Backend> backend = create_backend("cpu").backend;
    std::vector<View> views;
    std::array<Volume, 2> volumes{lone_vertebra(1), lone_vertebra(2)};
    std::deque<ResidentVolume> resident;
    RegistrationOptions options;
    RunControl control;
    SceneDescent scene{{}, options, control};
};

}  // namespace

TEST(SceneJudgement, ASearchThatEndsWhereTheSceneExplainsLessIsLeftOut) {
    TwoVertebrae both;
    const SceneResult result = both.judged_with_a_stray(0.5, 0.7);
    EXPECT_LT(both.error_mm(0, result.objects[0].world_from_ct), 0.3);
    EXPECT_TRUE(result.objects[0].reasons.empty()) << testing::PrintToString(result.objects[0].reasons);
}

TEST(SceneJudgement, ASearchThatEndsWhereAnObjectAloneFitsBetterIsHeldAgainstIt) {
    TwoVertebrae both;
    const SceneResult result = both.judged_with_a_stray(0.7, 0.5);
    EXPECT_LT(both.error_mm(0, result.objects[0].world_from_ct), 0.3);
    EXPECT_THAT(result.objects[0].reasons, Contains(HasSubstr("alone it fits better")));
}

TEST(SceneJudgement, WhatIsExplainedTogetherStaysThereWhereAloneLittleIs) {
    TwoVertebrae both;
    both.take_xrays();
    finish_together(both.scene);
    SceneResult result;
    judge_all(both.scene, both.objects(), result);
    const RigidTransform alone = result.objects[0].world_from_ct;
    result.objects[1].cost_final = 0.5;
    trust_what_is_explained(both.scene, both.objects(), result);
    EXPECT_EQ(result.objects[0].world_from_ct.translation_mm, alone.translation_mm);
    EXPECT_EQ(result.objects[1].world_from_ct.translation_mm, both.scene.world_from_ct[1].translation_mm);
    EXPECT_NE(alone.translation_mm, both.scene.world_from_ct[0].translation_mm);
}

// Each in the other's place, which is farther than a search of one alone reaches.
TEST(SceneJudgement, NeighboursThatLieInEachOthersPlacesChangeThem) {
    TwoVertebrae both;
    const Eigen::Vector3d apart_mm = both.resident[1].extent().centre_ct_mm - both.resident[0].extent().centre_ct_mm;
    ASSERT_GT(apart_mm.norm(), 20);
    both.scene.world_from_ct = {RigidTransform::translate(apart_mm), RigidTransform::translate(-apart_mm)};
    both.scene.starts_world_from_ct = both.scene.world_from_ct;
    both.take_xrays();
    finish_together(both.scene);
    SceneResult result;
    judge_all(both.scene, both.objects(), result);
    EXPECT_TRUE(take_better_places(both.scene, both.objects(), result));
    EXPECT_THAT(result.decisions, Contains(HasSubstr("L4 and L3: have changed places")));
    for (std::size_t k = 0; k < 2; ++k) EXPECT_LT(both.error_mm(k, both.scene.world_from_ct[k]), 0.3) << k;
}

TEST(SceneJudgement, WhatASearchHasConfirmedIsNotSoughtAgain) {
    TwoVertebrae both;
    both.take_xrays();
    finish_together(both.scene);
    both.scene.cost_final = 0.5;  // as if much were unexplained
    SceneResult result;
    judge_all(both.scene, both.objects(), result);
    const RegistrationResult sought = result.objects[0];
    ASSERT_TRUE(sought.ok && sought.search.mode == Search::near);
    judge_all(both.scene, both.objects(), result);
    EXPECT_TRUE(result.objects[0].ok);
    EXPECT_EQ(result.objects[0].search.refined, sought.search.refined);
    EXPECT_LT(result.objects[0].counters.linearizations, sought.counters.linearizations / 2);
    result.objects[0].ok = false;
    judge_all(both.scene, both.objects(), result);
    EXPECT_EQ(result.objects[0].counters.linearizations, sought.counters.linearizations);
}

// The outline of tissue that is no object, beyond which the detector is saturated, hides half of each bone. All
// together begin at the right places; with wide gradients they ended 10 and 11 mm off, with fine ones 4 and 5.
TEST(SceneDescent, TheOutlineOfTissueThatIsNoObjectLeadsNoBoneFar) {
    constexpr double kAtMost_mm = 7;
    TwoVertebrae both;
    for (View& view : both.views) {
        const int width = view.image.width;
        for (std::size_t p = 0; p < view.image.pixels.size(); ++p) {
            const double inside_px = width / 2.0 - static_cast<double>(p % static_cast<std::size_t>(width));
            float& pixel = view.image.pixels[p];
            pixel = inside_px > 0 ? 0.3F * pixel + 4 * static_cast<float>(std::sqrt(inside_px / 40)) : 0;
        }
    }
    both.take_xrays();
    descend_together(both.scene);
    for (std::size_t k = 0; k < 2; ++k) EXPECT_LT(both.error_mm(k, both.scene.world_from_ct[k]), kAtMost_mm) << k;
}

}  // namespace raylign::detail

// Searches, content mismatch, time limit, confidence: on the spine phantom, where every edge is exact.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "core/base/error.h"
#include "core/evaluation/mismatch.h"
#include "core/image/region.h"
#include "core/registration/strategy/candidates.h"
#include "raylign/backends.h"
#include "raylign/registration.h"
#include "raylign/targets.h"
#include "tests/support/errors.h"
#include "tests/support/scenes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail {
namespace {

/// A spine of 1.25 mm voxels, exact X-rays of it with photon noise.
struct SpineCase {
    explicit SpineCase(double photons = 1e6) {
        views = test::with_exact_images(test::biplane_views(128), spine_phantom({160, 160, 160}), truth, photons);
    }
    [[nodiscard]] RegistrationResult run(const RigidTransform& start, const RegistrationOptions& options = {}) {
        return register_volume(volume, views, start, options, *backend);
    }
    [[nodiscard]] double mtre_mm(const RigidTransform& pose) const {
        return mean_target_error_mm(pose, truth, default_targets_ct_mm(volume));
    }
    Volume volume = test::spine_volume(128);
    RigidTransform truth = test::oblique_pose();
    std::vector<View> views;
    std::unique_ptr<Backend> backend = create_backend("cpu").backend;
};

/// The middle of the spine without soft tissue, as a box and a bone threshold cut it.
Volume one_vertebra(const Volume& spine) {
    Volume bone = crop(spine, {{36, 40, 44}, {92, 112, 84}});
    for (float& v : bone.attenuation_per_mm) v = std::max(0.F, v - 0.0215F);
    return bone;
}

TEST(GlobalSearch, FindsTheSpineWithoutAStart) {
    SpineCase c;
    // Nominal: turned by 20 degrees and 60 mm away; the search only needs to know that it is in view.
    Twist twist;
    twist << 0.2, 0.2, -0.2, 40, -30, 35;
    const RegistrationResult found =
        c.run(exp(twist) * c.truth, {.search = {.mode = Search::global, .range_deg = 40, .starts = 4096}});
    EXPECT_LT(c.mtre_mm(found.world_from_ct), test::kFoundSpineMtre_mm);
    EXPECT_TRUE(found.ok) << (found.reasons.empty() ? "" : found.reasons.front());
    EXPECT_EQ(found.search.mode, Search::global);
    EXPECT_EQ(found.search.starts, 4096);
    EXPECT_GE(found.search.agreeing, 1);
}

TEST(NearSearch, FinishesWhatLiesUnderAnotherObjectAsADescentDoes) {
    SpineCase c;
    for (View& view : c.views) {  // a box of six times the spine's attenuation, most of it beside the spine
        const Image over =
            exact_drr(box_phantom({40, 60, 30}), view.geometry, RigidTransform::translate({30, 20, 10}) * c.truth);
        for (std::size_t i = 0; i < over.pixels.size(); ++i) view.image.pixels[i] += 6 * over.pixels[i];
    }
    const RigidTransform start = perturbed_start(c.truth, default_targets_ct_mm(c.volume), 12, 5);
    const RegistrationOptions options{.content = Content::whole, .search = {.mode = Search::near, .starts = 512}};
    const RegistrationResult found = c.run(start, options);
    EXPECT_LT(c.mtre_mm(found.world_from_ct), test::kFoundSpineMtre_mm);
    // Its cost is that of all pixels, not of those that the candidates were ranked on.
    const RegistrationResult descent = c.run(c.truth, {.content = Content::whole});
    EXPECT_NEAR(found.cost_final, descent.cost_final, 0.05 * descent.cost_final);
}

TEST(PartOfTheXray, OneVertebraIsFoundAmongTheOthers) {
    SpineCase c;
    c.volume = one_vertebra(c.volume);
    const RigidTransform start = perturbed_start(c.truth, default_targets_ct_mm(c.volume), 8, 3);
    const RegistrationResult found = c.run(start);
    EXPECT_EQ(found.content, Content::part);
    EXPECT_FALSE(found.decisions.empty());
    EXPECT_LT(c.mtre_mm(found.world_from_ct), test::kVertebraMtre_mm);
    EXPECT_EQ(found.search.mode, Search::near);
    EXPECT_GT(found.search.starts, 1000);
}

TEST(PartOfTheXray, AWideRangeIsSearchedToo) {
    SpineCase c;
    c.volume = one_vertebra(c.volume);
    Twist away;
    away << 0.2, -0.3, 0.2, 0, 0, 0;  // 55 mm and 24 degrees off: beyond the default range
    const RigidTransform start = RigidTransform::translate({40, -35, 15}) * exp(away) * c.truth;
    const RegistrationOptions options{.content = Content::part, .search = {.mode = Search::near, .range_mm = 90}};
    const RegistrationResult found = c.run(start, options);
    EXPECT_LT(c.mtre_mm(found.world_from_ct), test::kVertebraMtre_mm);
    EXPECT_GT(found.search.starts, 1000000);
}

TEST(PartOfTheXray, AFarResultIsLookedAroundOnceMore) {
    SpineCase c;
    c.volume = one_vertebra(c.volume);
    const auto found_from = [&](double off_mm, std::optional<double> range_mm) {
        return c.run(RigidTransform::translate({off_mm, 0, 0}) * c.truth,
                     {.content = Content::part, .search = {.mode = Search::near, .range_mm = range_mm}});
    };
    const auto once_more = testing::Contains(testing::HasSubstr("looked once more around the result"));
    const RegistrationResult far = found_from(18, {}), near = found_from(8, {}), asked_to_stay = found_from(18, 19);
    EXPECT_THAT(far.decisions, once_more);
    EXPECT_THAT(near.decisions, testing::Not(once_more));
    EXPECT_THAT(asked_to_stay.decisions, testing::Not(once_more));
    for (const RegistrationResult* result : {&far, &near, &asked_to_stay}) {
        EXPECT_LT(c.mtre_mm(result->world_from_ct), test::kVertebraMtre_mm);
        EXPECT_TRUE(result->ok);
    }
    EXPECT_NEAR(far.cost_initial, asked_to_stay.cost_initial, 0.05) << "that of the start that was given";
}

TEST(PartOfTheXray, SaysSoWhereTheSearchSeesTooLittleOfIt) {
    SpineCase c;
    c.volume = one_vertebra(c.volume);
    // Beside the detector by more than the search reaches: a sliver is still seen.
    const RigidTransform start = RigidTransform::translate({0, 0, 118}) * c.truth;
    const std::string message =
        test::error_of([&] { (void)c.run(start, {.content = Content::part, .search = {.mode = Search::near}}); });
    EXPECT_NE(message.find("within 20 mm of the start"), std::string::npos) << message;
}

TEST(PartOfTheXray, ATryThatComesToNoEndLeavesTheWhole) {
    // Hardly any light, and a detector that shows less than half of the spine: weak as a whole, impossible as a part.
    SpineCase c;
    c.views = test::with_exact_images(test::biplane_views(64, 60), spine_phantom({160, 160, 160}), c.truth, 15);
    const RegistrationResult whole = c.run(c.truth, {.content = Content::whole});
    const RegistrationResult found = c.run(c.truth);
    EXPECT_EQ(found.content, Content::whole);
    EXPECT_EQ((to_matrix(found.world_from_ct) - to_matrix(whole.world_from_ct)).norm(), 0);
    EXPECT_EQ(found.levels.size(), whole.levels.size());
    ASSERT_FALSE(found.decisions.empty());
    EXPECT_NE(found.decisions.back().find("as a part: search: no place"), std::string::npos) << found.decisions.back();
}

TEST(PartOfTheXray, RivalsAreThoseOfThePartAlone) {
    SpineCase c;
    c.volume = one_vertebra(c.volume);
    const RigidTransform start = perturbed_start(c.truth, default_targets_ct_mm(c.volume), 8, 3);
    const RegistrationResult asked = c.run(start, {.content = Content::part, .search = {.mode = Search::near}});
    const RegistrationResult found = c.run(start, {.search = {.mode = Search::near}});
    ASSERT_EQ(found.content, Content::part);
    EXPECT_EQ(found.search.rivals.size(), asked.search.rivals.size());
    EXPECT_EQ(found.search.starts, asked.search.starts);
}

TEST(PartOfTheXray, IsTakenAtItsWordWhenAskedFor) {
    SpineCase c;
    const RegistrationResult whole = c.run(c.truth, {.content = Content::whole});
    const RegistrationResult part = c.run(c.truth, {.content = Content::part, .search = {.mode = Search::none}});
    EXPECT_EQ(whole.content, Content::whole);
    EXPECT_EQ(part.content, Content::part);
    EXPECT_EQ(part.search.mode, Search::none);
    EXPECT_LT(part.levels.back().filter.sigma_px, whole.levels.back().filter.sigma_px);
}

TEST(RobustWeights, BringAResultCloserWhereMetalCrossesTheSpine) {
    SpineCase c;
    Volume actual = c.volume;
    add_rod(actual, {{-30, 10, -60}, {-12, 14, 60}, 2.5, 0.2});
    add_rod(actual, {{25, 20, -50}, {18, 8, 55}, 2.5, 0.2});
    const auto session = c.backend->prepare({actual, c.views, {Projector::trilinear, 0.4}, {}});
    for (std::size_t v = 0; v < c.views.size(); ++v) c.views[v].image = session->render(c.truth, v);
    const RigidTransform start = perturbed_start(c.truth, default_targets_ct_mm(c.volume), 6, 1);
    const RegistrationResult plain = c.run(start, {.content = Content::whole, .robust = false});
    const RegistrationResult robust = c.run(start, {.content = Content::whole});
    EXPECT_EQ(plain.robust_rounds, 0);
    EXPECT_GT(robust.robust_rounds, 0);
    EXPECT_LT(c.mtre_mm(robust.world_from_ct), 0.6 * c.mtre_mm(plain.world_from_ct));
    EXPECT_LT(c.mtre_mm(robust.world_from_ct), test::kSpineWithMetalMtre_mm) << "no less accurate than it was";
    // Finished with a fine filter, on a level of its own: the last one, which the last steps belong to.
    EXPECT_LT(robust.levels.back().filter.sigma_px, robust.levels.front().filter.sigma_px);
    EXPECT_EQ(robust.history.back().level, static_cast<int>(robust.levels.size()) - 1);
}

TEST(TimeLimit, ReturnsTheBestSoFarAndDoubtsIt) {
    SpineCase c;
    const RigidTransform start = perturbed_start(c.truth, default_targets_ct_mm(c.volume), 8, 1);
    const RegistrationResult found = c.run(start, {.time_limit_s = 1e-6});
    EXPECT_FALSE(found.ok);
    ASSERT_FALSE(found.reasons.empty());
    EXPECT_NE(found.reasons.front().find("time limit"), std::string::npos);
    EXPECT_TRUE(std::isnan(found.cost_final)) << "not a perfect 0";
    EXPECT_TRUE(std::isnan(found.cost_initial)) << "nothing is said of what was not evaluated";
    for (const std::string& reason : found.reasons) EXPECT_EQ(reason.find("not below"), std::string::npos) << reason;
    EXPECT_LE(c.mtre_mm(found.world_from_ct), 8.5);
}

TEST(SameInput, SameBits) {
    SpineCase c;
    c.volume = one_vertebra(c.volume);
    const RigidTransform start = perturbed_start(c.truth, default_targets_ct_mm(c.volume), 5, 3);
    const RegistrationOptions options{.search = {.mode = Search::near, .starts = 200}};
    const RegistrationResult a = c.run(start, options), b = c.run(start, options);
    EXPECT_EQ((to_matrix(a.world_from_ct) - to_matrix(b.world_from_ct)).norm(), 0);
    EXPECT_EQ(a.cost_final, b.cost_final);
}

TEST(Confidence, GrowsWithNoiseAndKnowsTheWeakDirection) {
    SpineCase quiet(1e7), noisy(200);
    const RegistrationResult a = quiet.run(quiet.truth), b = noisy.run(noisy.truth);
    EXPECT_GT(a.confidence.rim_mm, 0);
    EXPECT_GT(b.confidence.rim_mm, 2 * a.confidence.rim_mm);
    noisy.views.resize(1);
    const RegistrationResult single = noisy.run(noisy.truth);
    // The AP view looks along y: depth is what one view hardly sees.
    EXPECT_GT(std::abs(single.confidence.weakest_direction.y()), 0.95);
    EXPECT_GT(single.confidence.weakest_mm, 2 * b.confidence.weakest_mm);
}

TEST(Confidence, CoversTheBiasOfScatterThatADrrHasNot) {
    SpineCase c(1e6);
    const double ideal = c.mtre_mm(c.run(c.truth).world_from_ct);
    for (View& view : c.views) view.image = with_scatter(view.image, 0.5, 8);
    const RegistrationResult result = c.run(c.truth);
    const double error_mm = c.mtre_mm(result.world_from_ct);
    EXPECT_GT(error_mm, 1.5 * ideal) << "the bias is there";
    EXPECT_LT(error_mm, 2 * result.confidence.rim_mm);
    EXPECT_LT(result.confidence.rim_mm, 1.5) << "and it is not called hopeless";
}

TEST(Views, ThatLookAlongOneDirectionAreWarnedOf) {
    SpineCase c;
    EXPECT_TRUE(c.run(c.truth).decisions.empty());
    c.views[1] = c.views[0];
    c.views[1].name = "AP2";
    const RegistrationResult found = c.run(c.truth);
    ASSERT_FALSE(found.decisions.empty());
    EXPECT_NE(found.decisions.front().find("AP and AP2"), std::string::npos);
}

TEST(FarOptions, OutOfRangeAreErrors) {
    SpineCase c;
    EXPECT_THROW((void)c.run(c.truth, {.search = {.range_mm = -1}}), Error);
    EXPECT_THROW((void)c.run(c.truth, {.search = {.range_deg = 181}}), Error);
    EXPECT_THROW((void)c.run(c.truth, {.search = {.starts = 1000001}}), Error);
    EXPECT_THROW((void)c.run(c.truth, {.time_limit_s = std::nan("")}), Error);
}

TEST(Names, GoThereAndBack) {
    for (const char* name : {"auto", "gauss-newton", "steepest-descent", "bobyqa"}) {
        EXPECT_EQ(method_name(method_from_name(name)), name);
    }
    for (const char* name : {"auto", "whole", "part"}) EXPECT_EQ(content_name(content_from_name(name)), name);
    for (const char* name : {"auto", "none", "near", "global"}) EXPECT_EQ(search_name(search_from_name(name)), name);
    EXPECT_THROW((void)search_from_name("far"), Error);
    EXPECT_THROW((void)content_from_name(""), Error);
}

TEST(Hopeless, AnXrayOfSomethingElseIsGivenUpOn) {
    SpineCase c;
    c.views = test::with_exact_images(test::biplane_views(128), ellipsoid_phantom({120, 60, 90}), {}, 1e3);
    const RegistrationResult result =
        c.run(c.truth, {.content = Content::part, .search = {.mode = Search::near}, .suspect_mirrored = false});
    EXPECT_FALSE(result.ok);
    EXPECT_THAT(result.decisions, testing::Contains(testing::HasSubstr("not refined")));
    EXPECT_EQ(result.robust_rounds, 0) << "work is not wasted on it";
    EXPECT_LE(result.levels.back().iterations, 15);
    EXPECT_GT(result.cost_final, 0.8);
}

}  // namespace
}  // namespace raylign::detail

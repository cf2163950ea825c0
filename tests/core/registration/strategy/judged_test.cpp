#include "core/registration/strategy/judged.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/image/region.h"
#include "core/registration/policy.h"
#include "core/registration/strategy/coarse_to_fine.h"
#include "raylign/backends.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

/// A vertebra of the spine phantom, in the X-ray of all of it, on the finest level.
struct OneOfTheSpine {
    Volume vertebra = [] {
        Volume bone = crop(test::spine_volume(128), {{36, 40, 44}, {92, 112, 84}});
        for (float& v : bone.attenuation_per_mm) v = std::max(0.F, v - 0.0215F);
        return bone;
    }();
    RigidTransform truth = test::oblique_pose();
    std::vector<View> views =
        test::with_exact_images(test::biplane_views(128), spine_phantom({160, 160, 160}), truth, 1e6);
    std::unique_ptr<Backend> backend = create_backend("cpu").backend;
    RegistrationOptions options{.content = Content::part};
    RunControl control;
    ResidentVolume resident{vertebra, {}, *backend};
    Run run{resident, views, options, control, resident.extent(), truth};
    Level level{run, plan_run(run, Content::part).back(), Content::part};

    [[nodiscard]] RigidTransform turned(int axis, double turn_rad) const {
        Twist twist = Twist::Zero();
        twist[axis] = turn_rad;
        return exp_about(twist, truth * run.extent.centre_ct_mm) * truth;
    }
    [[nodiscard]] double off_mm(const Candidate& candidate) const {
        return apart_mm(candidate.world_from_ct, truth, run.extent);
    }
    [[nodiscard]] double same_mm() const { return kDistinct_px * level.plan().pixel_at_object_mm; }
};

TEST(LookAbout, FindsABetterPlaceBesideTheBest) {
    OneOfTheSpine c;
    // A place that a search took for the best one, though it is none: as far as one that explains little.
    std::vector<Candidate> candidates{{c.turned(2, 0.3), 0.9, 1}};
    ASSERT_GT(c.off_mm(candidates.front()), c.same_mm());
    look_about(c.run, c.level, candidates);
    EXPECT_LT(c.off_mm(candidates.front()), c.same_mm());
    EXPECT_LT(candidates.front().cost, 0.9);
    EXPECT_GE(c.run.result.search.refined, 24) << "around the first and around what was found";
}

TEST(LookAbout, LeavesTheBestWhereItIs) {
    OneOfTheSpine c;
    std::vector<Candidate> candidates = judged(c.run, c.level, std::vector<Candidate>{{c.truth, 0, 1}}, 15);
    ASSERT_EQ(candidates.size(), 1U);
    const Candidate best = candidates.front();
    look_about(c.run, c.level, candidates);
    EXPECT_LE(candidates.front().cost, best.cost);
    EXPECT_LT(apart_mm(candidates.front().world_from_ct, best.world_from_ct, c.run.extent), c.same_mm());
    EXPECT_EQ(c.run.result.search.refined, 12);
    EXPECT_GT(candidates.front().agreeing, best.agreeing) << "most of the descents end there as well";
}

TEST(LookAbout, APlaceThatIsHardlySeenLeadsNowhere) {
    OneOfTheSpine c;
    const RigidTransform beside = RigidTransform::translate({0, 0, 400}) * c.truth;
    std::vector<Candidate> candidates{{beside, 0.9, 1}};
    look_about(c.run, c.level, candidates);
    ASSERT_EQ(candidates.size(), 1U);
    EXPECT_EQ(candidates.front().cost, 0.9);
}

/// Bars six millimetres apart across the view, which fit again one further.
struct Bars {
    Volume volume = [] {
        Volume bars{centred_grid({56, 48, 16}, {1, 1, 1}), std::vector<float>(56 * 48 * 16)};
        for (int z = 2; z < 14; ++z) {
            for (int y = 2; y < 46; ++y) {
                for (int x = 2; x < 54; ++x) bars.attenuation_per_mm[bars.index(x, y, z)] = x % 6 < 3 ? 0.06F : 0.01F;
            }
        }
        return bars;
    }();
    RigidTransform truth = exp((Twist() << 1.5, 0.03, 0.05, 1, 2, 3).finished());  // seen from above
    std::vector<View> views{test::biplane_views(128).front()};
    std::unique_ptr<Backend> backend = create_backend("cpu").backend;
    RegistrationOptions options{.content = Content::part};
    RunControl control;
    ResidentVolume resident{volume, {}, *backend};

    [[nodiscard]] std::vector<Candidate> joined(const RigidTransform& other) {
        views.front().image = backend->prepare({volume, views, {}, {}})->render(truth, 0);
        Run run{resident, views, options, control, resident.extent(), truth};
        Level level{run, plan_run(run, Content::part).back(), Content::part};
        std::vector<Candidate> candidates{{truth, 0.1, 3}, {other, 0.2, 2}};
        join_valley(run, level, candidates);
        return candidates;
    }
};

TEST(JoinValley, AnEndOnTheWayToTheBestIsNoRival) {
    const std::vector<Candidate> left = Bars().joined(Bars().truth * RigidTransform::translate({1.5, 0, 0}));
    ASSERT_EQ(left.size(), 1U);
    EXPECT_EQ(left.front().agreeing, 5);
    EXPECT_EQ(left.front().cost, 0.1);
}

TEST(JoinValley, APlaceBeyondARidgeIs) {
    const std::vector<Candidate> left = Bars().joined(Bars().truth * RigidTransform::translate({6, 0, 0}));
    ASSERT_EQ(left.size(), 2U);
    EXPECT_EQ(left.front().agreeing, 3);
    EXPECT_EQ(left.back().cost, 0.2);
}

TEST(ReportRivals, ForgetsThoseOfASearchBefore) {
    OneOfTheSpine c;
    const RigidTransform near = RigidTransform::translate({20, 0, 0}) * c.truth;
    const RigidTransform far = RigidTransform::translate({0, 40, 0}) * c.truth;
    report_rivals(c.run, {{c.truth, 0.5, 3}, {near, 0.6, 1}, {far, 0.7, 1}}, 1);
    ASSERT_EQ(c.run.result.search.rivals.size(), 2U);
    report_rivals(c.run, {{near, 0.4, 2}, {far, 0.8, 1}}, 1);  // costs of other pixels
    ASSERT_EQ(c.run.result.search.rivals.size(), 1U);
    EXPECT_EQ(c.run.result.search.rivals.front().cost, 0.8);
    EXPECT_EQ(c.run.result.search.cost, 0.4);
    EXPECT_EQ(c.run.result.search.agreeing, 2);
}

}  // namespace
}  // namespace raylign::detail

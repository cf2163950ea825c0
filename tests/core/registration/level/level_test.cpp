#include <gtest/gtest.h>

#include "core/registration/level/level.h"
#include "raylign/backends.h"
#include "raylign/targets.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

/// The finest level of a run that has not begun yet.
struct FinestLevel {
    Volume volume = test::spine_volume(24);
    RigidTransform truth = test::oblique_pose();
    std::vector<View> views = test::with_exact_images(test::biplane_views(40), spine_phantom({160, 160, 160}), truth);
    BackendChoice choice = create_backend("reference");
    ResidentVolume resident{volume, {}, *choice.backend};
    RegistrationOptions options;
    RunControl control;
    RigidTransform start = perturbed_start(truth, default_targets_ct_mm(volume), 6, 1);
    Run run{resident, views, options, control, resident.extent(), start};
    LevelPlan plan = plan_levels(volume, views, start, resident.extent(), {1.5, 4}, {}).back();
    Level level{run, plan, Content::whole};

    FinestLevel() {
        run.result.method = Method::gauss_newton;
        run.result.world_from_ct = start;
    }
    [[nodiscard]] std::uint64_t evaluations() { return level.session().counters().evaluations; }
    [[nodiscard]] std::uint64_t linearizations() { return level.session().counters().linearizations; }
    [[nodiscard]] double fresh_cost(const RigidTransform& pose) {
        double cost = 0;
        level.session().evaluate({&pose, 1}, {&cost, 1});
        return cost;
    }
    void weigh_left_half() {
        std::vector<Image> weights;
        for (const View& view : level.views()) {
            Image& half = weights.emplace_back(view.image.width, view.image.height);
            for (int y = 0; y < half.height; ++y) {
                for (int x = 0; x < half.width / 2; ++x) half(x, y) = 1;
            }
        }
        level.session().set_weights(weights);
    }
};

TEST(Level, AsksForThePriceOfAPoseOnce) {
    FinestLevel finest;
    const double cost = finest.level.cost(finest.start);
    EXPECT_EQ(finest.level.cost(finest.start), cost);
    EXPECT_EQ(finest.level.view_costs(finest.start).size(), 2u);
    EXPECT_EQ(finest.evaluations(), 1u);
    EXPECT_EQ(finest.fresh_cost(finest.start), cost);
}

TEST(Level, ForgetsCostsWithTheWeightsThatTheyWereOf) {
    FinestLevel finest;
    const double whole = finest.level.cost(finest.start);
    finest.weigh_left_half();
    const double half = finest.level.cost(finest.start);
    EXPECT_NE(half, whole);
    EXPECT_EQ(half, finest.fresh_cost(finest.start));
    finest.weigh_left_half();
    EXPECT_EQ(finest.level.cost(finest.start), half);
    EXPECT_EQ(finest.evaluations(), 4u) << "also where new weights are the old ones";
}

TEST(Level, BeginsASearchWithWhatIsKnownOfItsStart) {
    FinestLevel finest;
    finest.level.take_the_better_start(true);
    EXPECT_EQ(finest.linearizations(), 1u);
    const LevelOutcome first = finest.level.optimize(finest.start, true, 1);
    EXPECT_LT(first.cost, finest.level.report().cost_initial);
    const std::uint64_t before = finest.linearizations();

    FinestLevel plain;
    const LevelOutcome again = plain.level.optimize(plain.start, true, 1);
    EXPECT_EQ(before, plain.linearizations()) << "the first one counted already";
    EXPECT_EQ(again.cost, first.cost);
    EXPECT_EQ(to_matrix(again.world_from_ct), to_matrix(first.world_from_ct));
    EXPECT_NEAR(plain.level.cost(again.world_from_ct), plain.fresh_cost(again.world_from_ct), 1e-12);
}

TEST(Level, LinearizesTheStartAnewWhereWeightsHaveChangedSince) {
    FinestLevel known, plain;
    known.level.take_the_better_start(true);
    known.weigh_left_half();
    plain.weigh_left_half();
    const LevelOutcome a = known.level.optimize(known.start, true, 1), b = plain.level.optimize(plain.start, true, 1);
    EXPECT_EQ(a.cost, b.cost);
    EXPECT_EQ(to_matrix(a.world_from_ct), to_matrix(b.world_from_ct));
}

}  // namespace
}  // namespace raylign::detail

#include "core/tracking/quick_way.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/median.h"
#include "core/image/region.h"
#include "core/registration/object/pose_space.h"
#include "raylign/backends.h"
#include "raylign/targets.h"
#include "raylign/tracking.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

TrackFrame compared(int frame, bool agrees, std::vector<double> costs) {
    return {.frame = frame, .status = TrackStatus::ok, .quick_view_costs = std::move(costs), .quick_agrees = agrees};
}

TrackFrame gone_quickly(int frame, std::vector<double> costs) {
    return {.frame = frame, .status = TrackStatus::ok, .quick = true, .quick_view_costs = std::move(costs)};
}

TEST(QuickWay, IsGoneAloneOnceItHasAgreedTwice) {
    QuickWay way;
    EXPECT_TRUE(way.is_open());
    way.remember(compared(1, true, {0.4, 0.4}));
    EXPECT_FALSE(way.is_confirmed());
    way.remember(compared(2, true, {0.4, 0.4}));
    EXPECT_TRUE(way.is_confirmed());
    EXPECT_EQ(way.coarser_by(), 1);
}

TEST(QuickWay, ItsExpectedErrorIsThatOfTheFullWayWhereBothWereGone) {
    QuickWay way;
    EXPECT_EQ(way.error_ratio(), 1);
    TrackFrame frame = compared(1, true, {0.4});
    frame.quick_error_ratio = 2;
    way.remember(frame);
    frame.quick_error_ratio = 3;
    way.remember(frame);
    EXPECT_EQ(way.error_ratio(), 3);
    way.remember(gone_quickly(3, {0.4}));
    EXPECT_EQ(way.error_ratio(), 3) << "frames that were not compared say nothing";
    way.remember(compared(4, false, {0.4}));
    EXPECT_EQ(way.error_ratio(), 1) << "another level, another ratio";
}

TEST(QuickWay, GoesToTheFinestLevelAndThenNowhereWhereItDisagrees) {
    QuickWay way;
    way.remember(compared(1, true, {0.4}));
    way.remember(compared(2, false, {0.4}));
    EXPECT_EQ(way.coarser_by(), 0);
    EXPECT_FALSE(way.is_confirmed());
    way.remember(compared(3, true, {0.5}));
    way.remember(compared(4, true, {0.5}));
    EXPECT_TRUE(way.is_confirmed());
    way.remember(compared(5, false, {0.5}));
    EXPECT_FALSE(way.is_open());
}

TEST(QuickWay, AViewThatCostsFarMoreIsUnusualAtOnceAndLittleByLittle) {
    QuickWay way;
    way.remember(compared(1, true, {0.2, 0.4}));
    way.remember(compared(2, true, {0.2, 0.4}));
    EXPECT_TRUE(way.is_usual(std::vector<double>{0.25, 0.5}));
    EXPECT_FALSE(way.is_usual(std::vector<double>{0.2, 0.55})) << "one view is enough";
    EXPECT_FALSE(way.is_usual(std::vector<double>{std::nan(""), 0.4}));
    double cost = 0.2;
    for (int frame = 3; frame < 300 && way.is_usual(std::vector<double>{cost, 0.4}); ++frame) {
        way.remember(gone_quickly(frame, {cost, 0.4}));
        cost += 0.005;
    }
    EXPECT_LT(cost, 0.7) << "twice the cost known, and what it may change by";
    EXPECT_GT(way.drift(), 1.3);
}

/// A vertebra of a spine that moves as a whole, in two noisy views of 128 x 128 pixels.
struct MovingVertebra {
    static constexpr double kExtent_mm = 200;
    Phantom spine = spine_phantom(Eigen::Vector3d::Constant(kExtent_mm));
    std::vector<View> geometry = test::biplane_views(128, 220);
    Volume volume;
    std::vector<Eigen::Vector3d> targets;
    BackendChoice choice = create_backend("cpu");

    MovingVertebra() {
        const Volume whole = voxelise(spine_vertebra(Eigen::Vector3d::Constant(kExtent_mm), 2),
                                      centred_grid({100, 100, 100}, {2, 2, 2}), 2);
        volume = crop(whole, box_of_object(whole));
        targets = default_targets_ct_mm(volume);
    }
    [[nodiscard]] static RigidTransform path(int frame) {
        Twist twist;
        twist << 0.1 * std::sin(0.15 * frame), 0.02 * frame, 0.05, 6 * std::sin(0.12 * frame), 1.5 * frame, -2;
        return exp(twist);
    }
    [[nodiscard]] std::vector<View> xrays(int frame) const {
        return test::with_exact_images(geometry, spine, path(frame), 50000);
    }
    [[nodiscard]] double mtre_mm(const TrackFrame& frame) const {
        return mean_target_error_mm(frame.world_from_ct, path(frame.frame), targets);
    }
    [[nodiscard]] Tracker tracker() {
        TrackOptions options;
        options.registration.content = Content::part;
        options.registration.search.mode = Search::none;
        options.recovery = Search::none;
        return {volume, perturbed_start(path(0), targets, 1, 1), options, *choice.backend};
    }
};

TEST(QuickWay, FindsAPartAsWellAsTheFullWayAndGoesOnWithTheSameBits) {
    MovingVertebra scene;
    Tracker tracker = scene.tracker(), resumed = scene.tracker();
    std::vector<TrackFrame> found;
    std::vector<double> expected_mm[2];  // in full, quickly
    int quick = 0;
    for (int frame = 0; frame < 9; ++frame) {
        found.push_back(tracker.feed(frame, scene.xrays(frame)));
        EXPECT_EQ(found.back().status, TrackStatus::ok) << frame;
        EXPECT_LT(scene.mtre_mm(found.back()), 0.5) << frame << (found.back().quick ? ": quick" : ": in full");
        EXPECT_GT(found.back().expected_error_mm, 0) << frame;
        quick += found.back().quick;
        expected_mm[found.back().quick ? 1 : 0].push_back(found.back().expected_error_mm);
    }
    EXPECT_GE(quick, 2) << "two frames tell a velocity, two or three are registered both ways";
    EXPECT_GT(median(expected_mm[1]), 0.8 * median(expected_mm[0])) << "as sure as the full way, and no surer";
    for (int frame = 0; frame < 8; ++frame) resumed.recall(found[frame]);
    const TrackFrame again = resumed.feed(8, scene.xrays(8));
    EXPECT_TRUE(again.quick);
    EXPECT_EQ(again.expected_error_mm, found[8].expected_error_mm);
    EXPECT_EQ(again.world_from_ct.rotation, found[8].world_from_ct.rotation);
    EXPECT_EQ(again.world_from_ct.translation_mm, found[8].world_from_ct.translation_mm);
}

TEST(QuickWay, ViewsAreAskedForAsFinelyAsTheyAreLookedAt) {
    MovingVertebra scene;
    Tracker given = scene.tracker(), asking = scene.tracker();
    int quick = 0;
    for (int frame = 0; frame < 7; ++frame) {
        std::vector<std::optional<int>> asked;
        const TrackFrame found = asking.feed(frame, [&](std::optional<int> coarser_by) {
            asked.push_back(coarser_by);
            return scene.xrays(frame);
        });
        const TrackFrame same = given.feed(frame, scene.xrays(frame));
        EXPECT_EQ(found.world_from_ct.rotation, same.world_from_ct.rotation) << frame;
        EXPECT_EQ(found.world_from_ct.translation_mm, same.world_from_ct.translation_mm) << frame;
        if (found.quick) {
            ASSERT_EQ(asked.size(), 1) << "made once";
            EXPECT_TRUE(asked[0].has_value()) << "and no finer";
        }
        if (found.quick_view_costs.empty()) {
            EXPECT_EQ(asked, (std::vector<std::optional<int>>{std::nullopt}));
        }
        quick += found.quick;
    }
    EXPECT_GT(quick, 0);
}

TEST(QuickWay, AFrameOfSomethingElseIsRegisteredInFullAndNotOk) {
    MovingVertebra scene;
    Tracker tracker = scene.tracker();
    for (int frame = 0; frame < 7; ++frame) (void)tracker.feed(frame, scene.xrays(frame));
    const auto other = test::with_exact_images(scene.geometry, ellipsoid_phantom({120, 60, 90}), {}, 50000);
    const TrackFrame wrong = tracker.feed(7, other);
    EXPECT_FALSE(wrong.quick);
    EXPECT_NE(wrong.status, TrackStatus::ok);
}

TEST(QuickWay, AFrameWhoseDetectorIsMissedIsRegisteredInFullAndLost) {
    MovingVertebra scene;
    Tracker tracker = scene.tracker();
    for (int frame = 0; frame < 7; ++frame) (void)tracker.feed(frame, scene.xrays(frame));
    std::vector<View> elsewhere = scene.xrays(7);
    elsewhere.front().geometry.camera_from_world.translation_mm.x() += 1000;
    const TrackFrame lost = tracker.feed(7, elsewhere);
    EXPECT_FALSE(lost.quick);
    EXPECT_EQ(lost.status, TrackStatus::lost);
    ASSERT_FALSE(lost.reasons.empty());
    EXPECT_NE(lost.reasons.front().find("misses the detector"), std::string::npos) << lost.reasons.front();
}

}  // namespace
}  // namespace raylign::detail

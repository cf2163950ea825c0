#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <span>

#include "core/base/error.h"
#include "raylign/backends.h"
#include "raylign/targets.h"
#include "raylign/tracking.h"
#include "tests/support/scenes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail {
namespace {

/// A spine on a known path in two noisy 64 x 64 views of 4 mm pixels at the object.
struct MovingSpine {
    Volume volume = test::spine_volume(40);
    Phantom phantom = spine_phantom({160, 160, 160});
    std::vector<View> geometry = test::biplane_views(64, 260);
    std::vector<Eigen::Vector3d> targets = default_targets_ct_mm(volume);
    BackendChoice choice = create_backend("cpu");

    /// Swings by some mm and degrees; from frame 9 on it stands elsewhere, as if frames had been cut out.
    [[nodiscard]] static RigidTransform path(int frame) {
        const double phase = 0.5 * frame;
        Twist twist;
        twist << 0.12 * std::sin(phase), 0.1 * std::cos(phase), 0.05 * phase, 8 * std::sin(phase), 3 * phase,
            -6 * std::cos(phase);
        const RigidTransform cut = RigidTransform::translate({18, -12, frame < 9 ? 0. : 10});
        return frame < 9 ? exp(twist) : cut * exp(twist);
    }
    [[nodiscard]] std::vector<View> xrays(int frame) const {
        return test::with_exact_images(geometry, phantom, path(frame), 20000);
    }
    [[nodiscard]] double mtre_mm(const TrackFrame& frame) const {
        return mean_target_error_mm(frame.world_from_ct, path(frame.frame), targets);
    }
    [[nodiscard]] Tracker tracker(const TrackOptions& options = {}) {
        return {volume, perturbed_start(path(0), targets, 5, 1), options, *choice.backend};
    }
};

std::string reasons(const TrackFrame& frame) {
    std::string all = std::to_string(frame.frame) + ":";
    for (const std::string& reason : frame.reasons) all += " " + reason + ";";
    return all;
}

TEST(Track, FollowsAKnownPathAcrossABlankFrameAndAJump) {
    MovingSpine spine;
    Tracker tracker = spine.tracker();
    for (int frame = 0; frame < 13; ++frame) {
        if (frame == 5) {
            const TrackFrame blank = tracker.skip(frame, "the image of view AP is constant");
            EXPECT_EQ(blank.status, TrackStatus::missing);
            EXPECT_EQ(blank.reasons.size(), 1u);
            continue;
        }
        const TrackFrame found = tracker.feed(frame, spine.xrays(frame));
        EXPECT_EQ(found.status, TrackStatus::ok) << reasons(found);
        EXPECT_LT(spine.mtre_mm(found), test::kTrackedFrameMtre_mm) << frame;
        EXPECT_EQ(found.searched != Search::none, frame == 9) << frame << ": only the jump is searched for";
        EXPECT_GT(found.expected_error_mm, 0);
        const bool is_predicted = frame > 2 && frame != 6 && frame != 9 && frame != 10;
        if (is_predicted) {
            EXPECT_LT(found.jump_mm, 5.5) << frame << ": the motion of up to 8 mm a frame is predicted";
        }
    }
}

TEST(Track, WithoutRecoveryAJumpIsFlaggedAndNotFollowedBlindly) {
    MovingSpine spine;
    TrackOptions options;
    options.recovery = Search::none;
    options.max_jump_mm = 8;
    Tracker tracker = spine.tracker(options);
    for (int frame = 0; frame < 9; ++frame)
        EXPECT_NE(tracker.feed(frame, spine.xrays(frame)).status, TrackStatus::lost);
    const TrackFrame jumped = tracker.feed(9, spine.xrays(9));
    EXPECT_EQ(jumped.status, TrackStatus::lost);
    EXPECT_EQ(jumped.searched, Search::none);
    EXPECT_FALSE(jumped.reasons.empty());
    EXPECT_LT((tracker.predicted(10).translation_mm - MovingSpine::path(8).translation_mm).norm(), 20)
        << "it goes on from the frames before";
}

TEST(Track, AFrameOfSomethingElseIsNotOk) {
    MovingSpine spine;
    TrackOptions options;
    options.recovery = Search::near;
    Tracker tracker = spine.tracker(options);
    for (int frame = 0; frame < 4; ++frame) (void)tracker.feed(frame, spine.xrays(frame));
    std::vector<View> other = test::with_exact_images(spine.geometry, ellipsoid_phantom({70, 20, 40}), {}, 20000);
    const TrackFrame wrong = tracker.feed(4, other);
    EXPECT_NE(wrong.status, TrackStatus::ok);
    EXPECT_FALSE(wrong.reasons.empty());
    const TrackFrame next = tracker.feed(5, spine.xrays(5));
    EXPECT_EQ(next.status, TrackStatus::ok) << reasons(next);
    EXPECT_LT(spine.mtre_mm(next), test::kTrackedFrameMtre_mm);
}

TEST(Track, AFarStartIsSearchedFor) {
    MovingSpine spine;
    Tracker tracker(spine.volume, RigidTransform::translate({75, -40, 70}), {}, *spine.choice.backend);
    const TrackFrame found = tracker.feed(0, spine.xrays(0));
    EXPECT_NE(found.searched, Search::none);
    EXPECT_LT(spine.mtre_mm(found), test::kTrackedFrameMtre_mm) << reasons(found);
}

TEST(Track, AGapBeforeTheFirstFrameLeavesItsSearch) {
    MovingSpine spine;
    TrackOptions options;
    options.recovery = Search::none;
    options.registration.search = {.mode = Search::near, .starts = 200};
    Tracker tracker = spine.tracker(options);
    (void)tracker.skip(0, "not taken");
    EXPECT_EQ(tracker.feed(1, spine.xrays(1)).searched, Search::near);
    EXPECT_EQ(tracker.feed(2, spine.xrays(2)).searched, Search::none) << "later ones without";
}

TEST(Track, AStartThatMissesTheViewsIsLostAndSaysSo) {
    MovingSpine spine;
    TrackOptions options;
    options.recovery = Search::near;
    Tracker tracker(spine.volume, RigidTransform::translate({0, 0, 900}), options, *spine.choice.backend);
    const TrackFrame found = tracker.feed(0, spine.xrays(0));
    EXPECT_EQ(found.status, TrackStatus::lost);
    ASSERT_EQ(found.reasons.size(), 1u);
    EXPECT_NE(found.reasons[0].find("misses the detector"), std::string::npos) << found.reasons[0];
}

TEST(Track, ALastingChangeOfTheImagesIsDoubtedButFollowed) {
    MovingSpine spine;
    Tracker tracker = spine.tracker();
    std::vector<TrackStatus> statuses;
    for (int frame = 0; frame < 8; ++frame) {
        auto views = spine.xrays(frame);
        for (View& view : views) {  // from frame 4 on something that stands still lies over the spine
            if (frame < 4) break;
            const Image over =
                exact_drr(box_phantom({40, 60, 30}), view.geometry, RigidTransform::translate({30, 20, 10}));
            for (std::size_t i = 0; i < over.pixels.size(); ++i) view.image.pixels[i] += 6 * over.pixels[i];
        }
        const TrackFrame found = tracker.feed(frame, views);
        EXPECT_NE(found.status, TrackStatus::lost) << reasons(found);
        EXPECT_LT(spine.mtre_mm(found), test::kTrackedFrameMtre_mm) << reasons(found);
        statuses.push_back(found.status);
    }
    EXPECT_EQ(statuses[3], TrackStatus::ok);
    EXPECT_EQ(statuses[4], TrackStatus::doubtful);
}

TEST(Track, BadInputIsRefusedAndLeavesTheTrackerAsItWas) {
    MovingSpine spine;
    TrackOptions bad;
    bad.max_jump_mm = -1;
    EXPECT_THROW((void)spine.tracker(bad), Error);
    bad = {};
    bad.frame_step = 0;
    EXPECT_THROW((void)spine.tracker(bad), Error);
    bad = {};
    bad.registration.levels = 9;
    EXPECT_THROW((void)spine.tracker(bad), Error) << "not a lost frame each";
    Tracker tracker = spine.tracker();
    (void)tracker.feed(3, spine.xrays(3));
    EXPECT_THROW((void)tracker.feed(3, spine.xrays(3)), Error) << "the same number again";
    EXPECT_THROW((void)tracker.skip(2, "gone"), Error);
    EXPECT_EQ(tracker.feed(4, spine.xrays(4)).status, TrackStatus::ok);
}

TEST(Track, StopsWhenAskedTo) {
    MovingSpine spine;
    Tracker tracker = spine.tracker({}), untouched = spine.tracker({});
    (void)tracker.feed(0, spine.xrays(0));
    (void)untouched.feed(0, spine.xrays(0));
    StopSource source;
    source.request_stop();
    EXPECT_EQ(tracker.feed(1, spine.xrays(1), {.stop = source.token()}).status, TrackStatus::stopped);
    const TrackFrame again = tracker.feed(1, spine.xrays(1)), never_stopped = untouched.feed(1, spine.xrays(1));
    EXPECT_EQ(again.status, TrackStatus::ok);
    EXPECT_EQ(to_matrix(again.world_from_ct), to_matrix(never_stopped.world_from_ct)) << "the stop left no trace";
}

TEST(Track, OfOneViewTheLastFramesDepthCounts) {
    MovingSpine spine;
    const std::vector<View> still = spine.xrays(0);
    const std::span<const View> one_view(still.data(), 1);
    std::array<TrackFrame, 2> last;
    for (const bool is_held : {false, true}) {
        TrackOptions options;
        if (is_held) options.depth_change_mm = 0.1;
        Tracker tracker = spine.tracker(options);
        for (int frame = 0; frame < 3; ++frame) last[is_held] = tracker.feed(frame, one_view);
        ASSERT_EQ(last[is_held].status, TrackStatus::ok) << reasons(last[is_held]);
        EXPECT_NEAR(std::hypot(last[is_held].expected_in_plane_mm, last[is_held].expected_in_depth_mm),
                    last[is_held].expected_error_mm, 1e-9);
    }
    // Three frames alike, hardly moved in between: surer by nearly the root of three.
    EXPECT_NEAR(last[1].expected_in_depth_mm / last[0].expected_in_depth_mm, std::sqrt(1 / 3.), 0.1);
    EXPECT_LT(spine.mtre_mm(last[1]), 2 * last[1].expected_error_mm + spine.mtre_mm(last[0]));
}

TEST(Track, TwoViewsTellDepthThemselves) {
    MovingSpine spine;
    TrackOptions options;
    options.depth_change_mm = 0.01;
    Tracker held = spine.tracker(options), free = spine.tracker();
    for (int frame = 0; frame < 2; ++frame) {
        const RigidTransform one = held.feed(frame, spine.xrays(frame)).world_from_ct;
        EXPECT_EQ(one.translation_mm, free.feed(frame, spine.xrays(frame)).world_from_ct.translation_mm);
    }
}

}  // namespace
}  // namespace raylign::detail

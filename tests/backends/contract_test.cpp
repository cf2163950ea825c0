// What every backend owes its caller, one fact a test, the same list for all.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/backends.h"
#include "tests/support/errors.h"
#include "tests/support/image_compare.h"
#include "tests/support/scenes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail {
namespace {

class BackendContract : public testing::TestWithParam<std::string> {
protected:
    void SetUp() override {
        RAYLIGN_MAKE_BACKEND(made, GetParam());
        backend_ = std::move(made);
    }
    [[nodiscard]] std::unique_ptr<Session> prepare(Projector projector = Projector::joseph,
                                                   Metric metric = Metric::gc) const {
        return backend_->prepare({volume_, views_, {projector, {}}, {metric, {1.5, 4}}});
    }
    [[nodiscard]] std::vector<double> costs(Session& session, const std::vector<RigidTransform>& poses) const {
        std::vector<double> result(poses.size(), -1);
        session.evaluate(poses, result);
        return result;
    }
    [[nodiscard]] std::vector<RigidTransform> poses(int count) const {
        std::vector<RigidTransform> list;
        for (int i = 0; i < count; ++i) {
            list.push_back(exp((Twist() << 0.03 * i, -0.02 * i, 0.01, 1.5 * i, -0.7 * i, 0.4).finished()) * truth_);
        }
        return list;
    }

    std::unique_ptr<Backend> backend_;
    Volume volume_ = test::spine_volume(24);
    RigidTransform truth_ = test::oblique_pose();
    std::vector<View> views_ = test::with_exact_images(test::biplane_views(33), spine_phantom({160, 160, 160}), truth_);
};

TEST_P(BackendContract, ABatchGivesTheBitsOfSinglePoses) {
    const auto session = prepare();
    const auto list = poses(7);
    const auto batch = costs(*session, list);
    for (std::size_t i = 0; i < list.size(); ++i) EXPECT_EQ(costs(*session, {list[i]})[0], batch[i]) << i;
}

TEST_P(BackendContract, TheOrderOfPosesDoesNotMatter) {
    const auto session = prepare();
    auto list = poses(5);
    auto forward = costs(*session, list);
    std::reverse(list.begin(), list.end());
    auto backward = costs(*session, list);
    std::reverse(backward.begin(), backward.end());
    EXPECT_EQ(forward, backward);
}

TEST_P(BackendContract, EvaluatingTwiceGivesTheSameBits) {
    const auto session = prepare();
    EXPECT_EQ(costs(*session, poses(3)), costs(*session, poses(3)));
    EXPECT_EQ(session->render(truth_, 0).pixels, session->render(truth_, 0).pixels);
}

TEST_P(BackendContract, VoxelsKnownToBeFiniteGiveTheSameBits) {
    const auto seen = backend_->prepare({volume_, views_, {}, {Metric::gc, {1.5, 4}}});
    const auto known = backend_->prepare({volume_, views_, {}, {Metric::gc, {1.5, 4}}, true});
    EXPECT_EQ(costs(*known, poses(3)), costs(*seen, poses(3)));
}

TEST_P(BackendContract, TakesEachTurnOfWorkBesideTheRenderingOnce) {
    const auto session = prepare();
    for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{1000}}) {
        std::vector<int> taken(count);
        session->for_each_index(count, [&](std::size_t i) { ++taken[i]; });
        backend_->for_each_index(count, [&](std::size_t i) { ++taken[i]; });
        EXPECT_EQ(taken, std::vector<int>(count, 2));
    }
    const auto throws_at_7 = [](std::size_t i) {
        if (i == 7) throw Error("turn 7");
    };
    EXPECT_EQ(test::error_of([&] { session->for_each_index(20, throws_at_7); }), "turn 7");
}

TEST_P(BackendContract, TwoSessionsLiveAtOnceAndOneOutlivesTheOther) {
    auto first = prepare();
    const auto alone = costs(*first, poses(2));
    const auto second = prepare(Projector::trilinear);
    EXPECT_EQ(costs(*first, poses(2)), alone);
    const auto others = costs(*second, poses(2));
    first.reset();
    EXPECT_EQ(costs(*second, poses(2)), others);
}

TEST_P(BackendContract, ASceneMayGoAwayAfterPrepare) {
    std::unique_ptr<Session> session;
    std::vector<double> expected = costs(*prepare(), poses(2));
    {
        const Volume volume = volume_;
        const std::vector<View> views = views_;
        session = backend_->prepare({volume, views, {}, {Metric::gc, {1.5, 4}}});
    }
    EXPECT_EQ(costs(*session, poses(2)), expected);
}

TEST_P(BackendContract, MovingVolumeAndCamerasTogetherChangesNothing) {
    const auto session = prepare();
    const RigidTransform move = exp((Twist() << 0.4, -0.3, 1.1, 30, -20, 55).finished());
    for (View& view : views_) view.geometry.camera_from_world = view.geometry.camera_from_world * inverse(move);
    const auto moved = prepare();
    EXPECT_TRUE(test::images_near(moved->render(move * truth_, 1), session->render(truth_, 1), 1e-6));
}

TEST_P(BackendContract, TwiceTheAttenuationIsTwiceTheImage) {
    Image twice = prepare()->render(truth_, 0);
    for (float& pixel : twice.pixels) pixel *= 2;
    for (float& value : volume_.attenuation_per_mm) value *= 2;
    EXPECT_TRUE(test::images_near(prepare()->render(truth_, 0), twice, 1e-6));
}

TEST_P(BackendContract, AGridsOriginAndDirectionAreHonoured) {
    const Image expected = prepare()->render(truth_, 0);
    // The same field on a grid whose x axis runs backwards: voxels reversed, direction mirrored, origin at the other
    // end.
    Volume mirrored = volume_;
    const int nx = volume_.grid.size.x();
    mirrored.grid.origin_mm = volume_.grid.ct_from_voxel({nx - 1.0, 0, 0});
    mirrored.grid.direction.col(0) *= -1;
    for (int z = 0; z < volume_.grid.size.z(); ++z) {
        for (int y = 0; y < volume_.grid.size.y(); ++y) {
            for (int x = 0; x < nx; ++x)
                mirrored.attenuation_per_mm[mirrored.index(x, y, z)] = volume_(nx - 1 - x, y, z);
        }
    }
    volume_ = mirrored;
    EXPECT_TRUE(test::images_near(prepare()->render(truth_, 0), expected, 1e-6));
}

// It meets that side's plane farther away than an int counts voxels.
TEST_P(BackendContract, ARayAlmostParallelToASideThatItMissesSeesNothing) {
    for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
        const auto session = prepare(projector);
        for (const double turn_rad : {1e-8, 1e-9, 1e-10, 1e-11, 1e-13, 0.0, -1e-9, -1e-10, -1e-11}) {
            Twist turn = Twist::Zero();
            turn[2] = turn_rad;
            const Image image = session->render(RigidTransform::translate({100, 0, 0}) * exp(turn), 0);
            EXPECT_EQ(image(16, 16), 0) << "the middle one, 20 mm beside the volume";
            EXPECT_GT(*std::ranges::max_element(image.pixels), 1) << "others meet it";
        }
    }
}

TEST_P(BackendContract, LookingAwayCostsOne) {
    const auto session = prepare();
    EXPECT_EQ(costs(*session, {RigidTransform::translate({0, 0, 5000})})[0], 1);
    for (const float pixel : session->render(RigidTransform::translate({0, 0, 5000}), 0).pixels) ASSERT_EQ(pixel, 0);
}

TEST_P(BackendContract, TheTruthCostsLessThanItsNeighbours) {
    const auto list = poses(4);
    const auto found = costs(*prepare(), {truth_, list[1], list[2], list[3]});
    EXPECT_LT(found[0], 0.02);
    for (int i = 1; i < 4; ++i) EXPECT_GT(found[i], found[i - 1]);
}

TEST_P(BackendContract, MaskedPixelsDoNotCount) {
    views_[0].weights = Image(33, 33, 1);
    for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 33; ++x) views_[0].weights(x, y) = 0;
    }
    const auto clean = costs(*prepare(), poses(2));
    for (int x = 0; x < 33; ++x) views_[0].image(x, 3) = x % 2 ? std::numeric_limits<float>::quiet_NaN() : 1e6F;
    EXPECT_EQ(costs(*prepare(), poses(2)), clean);
}

TEST_P(BackendContract, ANonFinitePoseIsRefusedByItsIndex) {
    auto list = poses(2);
    list[1].rotation(0, 0) = std::nan("");
    const auto session = prepare();
    const std::string message = test::error_of([&] { (void)costs(*session, list); });
    EXPECT_NE(message.find("pose 1"), std::string::npos) << message;
}

TEST_P(BackendContract, SpansOfDifferentSizesAreRefusedWithBothNumbers) {
    std::vector<double> three(3);
    const auto list = poses(2);
    const auto session = prepare();
    const std::string message = test::error_of([&] { session->evaluate(list, three); });
    EXPECT_NE(message.find("number of costs = 3"), std::string::npos) << message;
    EXPECT_NE(message.find("must be 2"), std::string::npos) << message;
}

TEST_P(BackendContract, AnEmptyBatchIsNothing) { EXPECT_TRUE(costs(*prepare(), {}).empty()); }

TEST_P(BackendContract, ViewsWithoutImagesRenderButHaveNoCosts) {
    const Image expected = prepare()->render(truth_, 1);
    views_[0].image = {};
    const auto session = prepare();
    EXPECT_EQ(session->render(truth_, 1).pixels, expected.pixels);
    EXPECT_THROW((void)costs(*session, poses(1)), Error);
}

TEST_P(BackendContract, CountsEvaluationsAndTimesItsStages) {
    const auto session = prepare();
    (void)costs(*session, poses(3));
    (void)costs(*session, poses(2));
    EXPECT_EQ(session->counters().evaluations, 5u);
    EXPECT_GT(session->timing().drr_s, 0);
    EXPECT_GT(session->timing().gradient_s + session->timing().reduction_s, 0) << "backends may fuse the two";
    EXPECT_GE(session->volume_bytes(), volume_.attenuation_per_mm.size() * 2);
}

TEST_P(BackendContract, OtherViewsOfAResidentVolumeGiveTheBitsOfAFreshPrepare) {
    const Similarity other_filter{Metric::gc, {1, 3}};
    std::vector<View> others =
        test::with_exact_images({{"OBL", test::c_arm_view(35, 29), {}, {}}}, spine_phantom({160, 160, 160}), truth_);
    others[0].weights = Image(29, 29, 1);
    others[0].weights(14, 14) = 0;
    for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
        const auto resident = prepare(projector);
        const auto before = costs(*resident, poses(3));
        const auto shared = resident->with_views(others, other_filter);
        const auto fresh = backend_->prepare({volume_, others, {projector, {}}, other_filter});
        EXPECT_EQ(costs(*shared, poses(3)), costs(*fresh, poses(3)));
        EXPECT_EQ(shared->render(truth_, 0).pixels, fresh->render(truth_, 0).pixels);
        EXPECT_EQ(costs(*resident, poses(3)), before) << "the first session is as it was";
        EXPECT_THROW((void)shared->render(truth_, 1), Error) << "it has one view";
    }
}

TEST_P(BackendContract, SessionsThatShareAVolumeEndInAnyOrder) {
    auto resident = prepare();
    const auto expected = costs(*resident, poses(2));
    auto shared = resident->with_views(views_, {Metric::gc, {1.5, 4}});
    resident.reset();
    EXPECT_EQ(costs(*shared, poses(2)), expected);
    const auto next = shared->with_views(views_, {Metric::gc, {1.5, 4}});
    shared.reset();
    EXPECT_EQ(costs(*next, poses(2)), expected);
}

TEST_P(BackendContract, WeightsOfOneSessionDoNotReachAnotherOfTheSameVolume) {
    const auto resident = prepare();
    const auto expected = costs(*resident, poses(2));
    const auto shared = resident->with_views(views_, {Metric::gc, {1.5, 4}});
    std::vector<Image> weights(2, Image(33, 33, 1));
    for (int x = 0; x < 33; ++x) weights[0](x, 16) = 0;
    shared->set_weights(weights);
    EXPECT_NE(costs(*shared, poses(2)), expected);
    EXPECT_EQ(costs(*resident, poses(2)), expected);
}

TEST_P(BackendContract, OtherViewsAreCheckedLikeTheFirst) {
    const auto resident = prepare();
    EXPECT_THROW((void)resident->with_views({}, {Metric::gc, {1.5, 4}}), Error);
    views_[1].cost_weight = -1;
    EXPECT_THROW((void)resident->with_views(views_, {Metric::gc, {1.5, 4}}), Error);
    views_[1].cost_weight = 1;
    views_[1].image = Image(33, 33, 2);
    EXPECT_THROW((void)resident->with_views(views_, {Metric::gc, {1.5, 4}}), Error) << "constant";
}

INSTANTIATE_TEST_SUITE_P(All, BackendContract, testing::ValuesIn(backend_names()),
                         [](const auto& test) { return test::test_name(test.param); });

}  // namespace
}  // namespace raylign::detail

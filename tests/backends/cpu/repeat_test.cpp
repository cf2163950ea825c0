// The same input gives the same bits: at any number of threads, in any batch, in any order.
#include <algorithm>

#include "allocation_count.h"
#include "cpu_scenes.h"

namespace raylign::detail {
static bool operator==(const MomentSums& a, const MomentSums& b) {
    return a.weight == b.weight && a.fixed == b.fixed && a.fixed_fixed == b.fixed_fixed && a.moving == b.moving &&
           a.moving_moving == b.moving_moving && a.fixed_moving == b.fixed_moving;
}
}  // namespace raylign::detail

namespace raylign::detail::test {
namespace {

NamedScene repeat_scene(int side_px) {
    NamedScene scene{"repeat", random_volume({40, 44, 36}, {1, 0.9, 1.2}, 21, 0.5), {}};
    scene.views = {view_along(rotation(20, 30, 10), {side_px, side_px - 3}, 60.0 / side_px),
                   view_along(rotation(95, 30, 10), {side_px - 7, side_px}, 60.0 / side_px)};
    add_images(scene, pose_near_identity(5, 0.3));
    return scene;
}

std::vector<RigidTransform> some_poses(int count) {
    std::vector<RigidTransform> poses;
    for (int i = 0; i < count; ++i) poses.push_back(pose_near_identity(100 + i, 2));
    return poses;
}

class CpuRepeat : public testing::TestWithParam<int> {  // side of the image
protected:
    NamedScene named_ = repeat_scene(GetParam());
    std::vector<RigidTransform> poses_ = some_poses(11);

    [[nodiscard]] std::unique_ptr<Session> session(int threads) const {
        return make_cpu_backend({.threads = threads})->prepare(named_.scene(Projector::joseph));
    }
};

TEST_P(CpuRepeat, AnyNumberOfThreadsGivesTheSameBits) {
    const std::vector<MomentSums> expected = session(1)->moment_sums(poses_);
    const Image image = session(1)->render(poses_[0], 1);
    for (const int threads : {2, 3, 7}) {
        auto other = session(threads);
        for (int repetition = 0; repetition < 3; ++repetition) {
            EXPECT_TRUE(other->moment_sums(poses_) == expected) << threads << " threads";
            EXPECT_EQ(other->render(poses_[0], 1).pixels, image.pixels) << threads << " threads";
        }
    }
}

TEST_P(CpuRepeat, ABatchEqualsItsPosesOneByOne) {
    auto one = session(2);
    const std::vector<MomentSums> batch = one->moment_sums(poses_);
    std::vector<MomentSums> singly;
    for (const RigidTransform& pose : poses_) {
        const std::vector<MomentSums> sums = one->moment_sums({&pose, 1});
        singly.insert(singly.end(), sums.begin(), sums.end());
    }
    EXPECT_TRUE(singly == batch);
}

TEST_P(CpuRepeat, OrderOfPosesDoesNotMatter) {
    std::vector<double> forward(poses_.size()), backward(poses_.size());
    session(2)->evaluate(poses_, forward);
    std::ranges::reverse(poses_);
    session(2)->evaluate(poses_, backward);
    std::ranges::reverse(backward);
    EXPECT_EQ(forward, backward);
}

TEST_P(CpuRepeat, SessionsDoNotDisturbEachOther) {
    const std::vector<MomentSums> expected = session(2)->moment_sums(poses_);
    auto first = session(2);
    auto second = session(3);
    (void)second->moment_sums(some_poses(3));
    EXPECT_TRUE(first->moment_sums(poses_) == expected);
    first.reset();
    EXPECT_TRUE(second->moment_sums(poses_) == expected);
}

TEST_P(CpuRepeat, AWarmSessionAllocatesNothingPerPose) {
    auto one = session(1);  // all on this thread, whose allocations are counted
    const auto count = [&](std::size_t poses) {
        const std::size_t before = allocation_count();
        (void)one->moment_sums(std::span(poses_).first(poses));
        return allocation_count() - before;
    };
    (void)count(1);
    (void)count(poses_.size());
    EXPECT_EQ(count(1), count(poses_.size()));
}

INSTANTIATE_TEST_SUITE_P(Sides, CpuRepeat, testing::Values(40, 141));

}  // namespace
}  // namespace raylign::detail::test

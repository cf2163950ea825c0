// As many threads run as were asked for, whatever the machine has and whoever else has asked.
#include <gtest/gtest.h>

#include <atomic>
#include <latch>
#include <thread>

#include "backends/cpu/workers.h"
#include "cpu_scenes.h"

namespace raylign::detail::test {
namespace {

/// Runs `count` turns that each wait until all have begun. No clock decides: where threads are missing this never
/// returns, and CTest's timeout is the failure. Returns how many turns came through.
int run_together(cpu::Workers& workers, int count) {
    std::latch all(count);
    std::atomic<int> through = 0;
    workers.run(count, [&](std::size_t, int) {
        all.arrive_and_wait();
        ++through;
    });
    return through;
}

TEST(CpuWorkers, MoreThreadsThanCoresRunAtTheSameTime) {
    const int many = cpu::usable_cores() + 5;
    cpu::Workers workers(many);
    EXPECT_EQ(run_together(workers, many), many);
}

TEST(CpuWorkers, OthersThatAskedForFewerDoNotLimitThem) {
    const int many = cpu::usable_cores() + 5;
    testing::internal::CaptureStderr();
    cpu::Workers few(many - 3), workers(many), more(many + 2);
    EXPECT_EQ(run_together(few, many - 3), many - 3);
    EXPECT_EQ(run_together(workers, many), many);
    EXPECT_EQ(run_together(more, many + 2), many + 2);
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << "a library does not print, nor do those that it uses";
}

TEST(CpuWorkers, TurnsAtTheSameTimeHaveDifferentSlots) {
    constexpr int kThreads = 9;
    cpu::Workers workers(kThreads);
    std::atomic<bool> taken[kThreads] = {}, clash = false;
    workers.run(2000, [&](std::size_t, int slot) {
        if (slot < 0 || slot >= kThreads || taken[slot].exchange(true)) {
            clash = true;
            return;
        }
        std::this_thread::yield();
        taken[slot] = false;
    });
    EXPECT_FALSE(clash);
}

TEST(CpuWorkers, FarMoreThreadsThanTilesGiveTheSameBits) {
    NamedScene named{"threads", random_volume({30, 30, 30}, {1, 1, 1}, 6, 0.3), {}};
    named.views = {view_along(rotation(20, 30, 10), {40, 35}, 1.5)};
    add_images(named, pose_near_identity(5, 0.3));
    const Scene scene = named.scene(Projector::joseph, {Metric::gc, {1, 3}});
    const auto one = make_cpu_backend({.threads = 1})->prepare(scene);
    const auto many = make_cpu_backend({.threads = 64})->prepare(scene);
    const std::vector<RigidTransform> poses = {{}, pose_near_identity(3)};
    std::vector<Linearization> expected(2), found(2);
    one->linearize(poses, {0, 0, 0}, expected);
    many->linearize(poses, {0, 0, 0}, found);
    for (int i = 0; i < 2; ++i) {
        EXPECT_EQ(found[i].cost, expected[i].cost);
        EXPECT_EQ(found[i].gradient, expected[i].gradient);
        EXPECT_EQ(many->render(poses[i], 0).pixels, one->render(poses[i], 0).pixels);
    }
}

}  // namespace
}  // namespace raylign::detail::test

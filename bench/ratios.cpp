// What the cpu backend's work costs in units of one of its DRRs: derivatives, threads, projectors, storage, setup; and
// how many cost evaluations a second it makes of small images. Things that are compared take turns, pose by pose, so
// that a busy machine slows both; the ratio is the median over all pairs.
//
// Usage: raylign_ratios [voxels=256] [pixels=256] [poses=21] [rounds=3] [--json FILE]

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <numeric>
#include <optional>
#include <string>
#include <thread>

#include "bench/bench_scene.h"
#include "bench/program.h"
#include "bench/record.h"
#include "core/base/error.h"
#include "core/base/median.h"
#include "core/image/pyramid.h"

namespace raylign::detail::bench {
namespace {

double seconds(const std::function<void()>& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// All orientations are equally likely.
std::vector<RigidTransform> poses_all_around(int count) {
    Random random(5);
    std::vector<RigidTransform> poses(count);
    for (RigidTransform& pose : poses) {
        pose.rotation = Eigen::Quaterniond(random.normal(), random.normal(), random.normal(), random.normal())
                            .normalized()
                            .toRotationMatrix();
        for (int axis = 0; axis < 3; ++axis) pose.translation_mm[axis] = random.uniform(-10, 10);
    }
    return poses;
}

/// A way to spend time on a pose; returns the seconds that count.
using Work = std::function<double(const RigidTransform&)>;

struct Comparison {
    std::string what;
    Work one, other;
};

/// All of them take turns on each pose.
void print(std::span<const Comparison> comparisons, const std::vector<RigidTransform>& poses, int rounds,
           Record& record) {
    struct Times {
        std::vector<double> one_s, other_s, ratio;
    };
    std::vector<Times> times(comparisons.size());
    for (const RigidTransform& pose : poses) {  // makes copies and touches pages
        for (const Comparison& comparison : comparisons) {
            (void)comparison.one(pose);
            (void)comparison.other(pose);
        }
    }
    for (int round = 0; round < rounds; ++round) {
        for (const RigidTransform& pose : poses) {
            for (std::size_t i = 0; i < comparisons.size(); ++i) {
                times[i].one_s.push_back(comparisons[i].one(pose));
                times[i].other_s.push_back(comparisons[i].other(pose));
                times[i].ratio.push_back(times[i].one_s.back() / times[i].other_s.back());
            }
        }
    }
    for (std::size_t i = 0; i < comparisons.size(); ++i) {
        std::printf("%-66s %8.2f ms %8.2f ms  ratio %.2f\n", comparisons[i].what.c_str(), 1e3 * median(times[i].one_s),
                    1e3 * median(times[i].other_s), median(times[i].ratio));
        record.add({comparisons[i].what, 1e3 * median(times[i].one_s), 1e3 * median(times[i].other_s),
                    median(times[i].ratio)});
    }
}

/// `steps` multiply-adds on each of 32 numbers, which stay in registers: no memory to wait for.
float multiply_adds(long steps) {
    float values[32];
    for (int i = 0; i < 32; ++i) values[i] = static_cast<float>(i);
    for (long step = 0; step < steps; ++step) {
        for (float& value : values) value = value * 0.999F + 0.001F;
    }
    return std::accumulate(std::begin(values), std::end(values), 0.F);
}

/// What two threads can gain on this machine at this moment: the same arithmetic on one thread or shared by two, about
/// as long as a DRR.
Work arithmetic(int threads) {
    return [threads](const RigidTransform&) {
        constexpr long kSteps = 3'500'000;
        std::array<float, 2> results{};
        const double taken_s = seconds([&] {
            std::jthread other;
            if (threads == 2) other = std::jthread([&] { results[1] = multiply_adds(kSteps / 2); });
            results[0] = multiply_adds(kSteps / threads);
        });
        if (!(results[0] > 0 && results[0] < 33)) throw Error("arithmetic that is not done");
        return taken_s;
    };
}

/// All poses one after the other, as a registration asks for them: the other thread has no time to fall asleep.
Work all_of(const std::vector<RigidTransform>& poses, const Work& work) {
    return [&poses, work](const RigidTransform&) {
        double sum_s = 0;
        for (const RigidTransform& pose : poses) sum_s += work(pose);
        return sum_s;
    };
}

class TimedSession {
public:
    /// Without `storage`: what the backend keeps by itself.
    TimedSession(const BenchScene& scene, int threads, Projector projector = Projector::joseph,
                 const std::optional<Storage>& storage = {})
        : session_(create_backend("cpu", {.cpu = {.threads = threads, .storage = storage}})
                       .backend->prepare({scene.volume, std::span(scene.views).first(1), {projector, {}}, {}})) {}

    [[nodiscard]] Work drr() const {
        return [s = session_](const RigidTransform& pose) { return seconds([&] { (void)s->render(pose, 0); }); };
    }
    [[nodiscard]] Work evaluate() const {
        return [s = session_](const RigidTransform& pose) {
            double cost = 0;
            return seconds([&] { s->evaluate({&pose, 1}, {&cost, 1}); });
        };
    }
    [[nodiscard]] Work linearize() const {
        return [s = session_](const RigidTransform& pose) { return seconds([&] { linearize_once(*s, pose); }); };
    }
    /// The part of linearize that makes images.
    [[nodiscard]] Work derivative_images() const {
        return [s = session_](const RigidTransform& pose) {
            const double before_s = s->timing().drr_s;
            linearize_once(*s, pose);
            return s->timing().drr_s - before_s;
        };
    }

private:
    static void linearize_once(Session& session, const RigidTransform& pose) {
        Linearization result;
        session.linearize({&pose, 1}, Eigen::Vector3d::Zero(), {&result, 1});
    }

    std::shared_ptr<Session> session_;
};

void print_setup(const BenchScene& scene, const std::vector<RigidTransform>& poses, Record& record) {
    std::vector<double> prepare_s, copies_s, pyramid_s, drr_s;
    for (int round = 0; round < 5; ++round) {
        std::shared_ptr<Session> session;
        prepare_s.push_back(seconds([&] {
            session = create_backend("cpu").backend->prepare({scene.volume, std::span(scene.views).first(1), {}, {}});
        }));
        const double before_s = session->timing().prepare_s;
        for (const RigidTransform& pose : poses) (void)session->render(pose, 0);  // from all around: makes all copies
        copies_s.push_back(session->timing().prepare_s - before_s);
        pyramid_s.push_back(seconds([&] { (void)half_resolution(half_resolution(scene.volume)); }));
        for (const RigidTransform& pose : poses) drr_s.push_back(seconds([&] { (void)session->render(pose, 0); }));
    }
    const double drr = median(drr_s), all = median(prepare_s) + median(copies_s) + median(pyramid_s);
    std::printf(
        "setup: prepare %.1f ms, the other copies %.1f ms, two levels of the pyramid %.1f ms: %.1f DRRs of %.2f ms\n",
        1e3 * median(prepare_s), 1e3 * median(copies_s), 1e3 * median(pyramid_s), all / drr, 1e3 * drr);
    record.add({"setup : DRR", 1e3 * all, 1e3 * drr, all / drr});
}

/// One view of 64^2 pixels of 64^3 voxels, gradient correlation.
void print_small_batches(Record& record) {
    const BenchScene scene = make_scene(64, 64);
    std::printf("\n64^3 voxels, 64^2 pixels, one view, gradient correlation: cost evaluations a second\n%8s", "batch");
    for (const int threads : {1, 2}) std::printf("%12d thread%s", threads, threads > 1 ? "s" : "");
    for (const int batch : {1, 4, 16, 64, 256}) {
        std::printf("\n%8d", batch);
        std::vector<double> each_ms;
        for (const int threads : {1, 2}) {
            const auto session = create_backend("cpu", {.cpu = {.threads = threads}})
                                     .backend->prepare({scene.volume, std::span(scene.views).first(1), {}, {}});
            const auto poses = poses_around(scene.truth, 256);
            std::vector<double> costs(poses.size()), rates;
            for (int round = 0; round < 9; ++round) {
                rates.push_back(static_cast<double>(poses.size()) / seconds([&] {
                                    for (std::size_t i = 0; i < poses.size(); i += batch) {
                                        session->evaluate(std::span(poses).subspan(i, batch),
                                                          std::span(costs).subspan(i, batch));
                                    }
                                }));
            }
            std::printf("%19.0f", median(rates));
            each_ms.push_back(1e3 / median(rates));
            if (!std::ranges::all_of(costs, [](double cost) { return cost > 0 && cost < 2; }))
                throw Error("a wrong cost");
        }
        record.add({"cost evaluation, 64^2 of 64^3, batch of " + std::to_string(batch) + ", one thread : two",
                    each_ms[0], each_ms[1], each_ms[0] / each_ms[1]});
    }
    std::printf("\n");
}

void run(int voxels, int pixels, int pose_count, int rounds, Record& record) {
    const BenchScene scene = make_scene(voxels, pixels);
    const auto poses = poses_all_around(pose_count);
    const TimedSession two(scene, 2), one(scene, 1), trilinear(scene, 2, Projector::trilinear),
        int16(scene, 2, Projector::joseph, Storage::int16), float32(scene, 2, Projector::joseph, Storage::float32),
        trilinear16(scene, 2, Projector::trilinear, Storage::int16),
        trilinear32(scene, 2, Projector::trilinear, Storage::float32);
    const BackendInfo info = create_backend("cpu").backend->info();
    std::printf("%s, %s, spine phantom %d^3, %d^2 pixels, %d poses over all orientations, %d rounds, two threads\n\n",
                info.device.c_str(), info.instruction_set.c_str(), voxels, pixels, pose_count, rounds);
    const Comparison derivatives[] = {
        {"DRR and its six derivative images : DRR", two.derivative_images(), two.drr()},
        {"linearize (cost, gradient, Gauss-Newton matrix) : DRR", two.linearize(), two.drr()},
        {"linearize : evaluate", two.linearize(), two.evaluate()},
    };
    const Comparison threads[] = {
        {"arithmetic without memory, one thread : two", arithmetic(1), arithmetic(2)},
        {"DRR on one thread : on two", one.drr(), two.drr()},
        {"linearize on one thread : on two", one.linearize(), two.linearize()},
    };
    const Comparison in_turn[] = {
        {"DRRs one after the other, one thread : two", all_of(poses, one.drr()), all_of(poses, two.drr())},
        {"linearize one after the other, one thread : two", all_of(poses, one.linearize()),
         all_of(poses, two.linearize())},
    };
    const Comparison projectors[] = {
        {"DRR trilinear (steps of half a voxel) : joseph", trilinear.drr(), two.drr()},
        {"trilinear, and its six derivative images : DRR", trilinear.derivative_images(), trilinear.drr()},
    };
    const Comparison storages[] = {
        {"DRR of int16 voxels : of float32", int16.drr(), float32.drr()},
        {"linearize of int16 voxels : of float32", int16.linearize(), float32.linearize()},
        {"DRR trilinear of int16 voxels : of float32", trilinear16.drr(), trilinear32.drr()},
    };
    record.note("spine phantom, poses over all orientations, two threads; " + info.device + ", " +
                info.instruction_set);
    print(derivatives, poses, rounds, record);
    print(threads, poses, rounds, record);
    print(in_turn, {poses.front()}, 2 * rounds + 1, record);
    print(projectors, poses, rounds, record);
    print(storages, poses, rounds, record);
    print_setup(scene, poses, record);
    print_small_batches(record);
    record.write();
}

}  // namespace
}  // namespace raylign::detail::bench

int main(int argc, char** argv) {
    const auto number = [&](int i, int fallback) { return argc > i ? std::atoi(argv[i]) : fallback; };
    return raylign::detail::bench::run_program("raylign_ratios", [&] {
        raylign::detail::bench::Record record(argc, argv, "Ratios of the cpu backend",
                                              {"one : other", "one [ms]", "other [ms]", "ratio, median"});
        raylign::detail::bench::run(number(1, 256), number(2, 256), number(3, 21), number(4, 3), record);
        return 0;
    });
}

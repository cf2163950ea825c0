// How much faster is one backend than another per DRR? Both render the same random poses in turn, in one run; the
// images are compared first; the ratio is the median over rounds. Usage:
//   raylign_speedup [fast=cpu] [slow=reference] [voxels=256] [pixels=256] [rounds=9] [--json FILE]

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "bench/bench_scene.h"
#include "bench/program.h"
#include "bench/record.h"
#include "core/base/error.h"
#include "core/base/median.h"
#include "core/validation/tolerances.h"

namespace raylign::detail::bench {
namespace {

double seconds_to_render(Session& session, const RigidTransform& pose) {
    const auto start = std::chrono::steady_clock::now();
    const Image image = session.render(pose, 0);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Largest difference as a share of the image's maximum.
double difference(const Image& a, const Image& b) {
    double largest = 0, maximum = 0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
        largest = std::max(largest, std::abs(static_cast<double>(a.pixels[i]) - b.pixels[i]));
        maximum = std::max(maximum, std::abs(static_cast<double>(b.pixels[i])));
    }
    return largest / maximum;
}

int run(const std::string& fast_name, const std::string& slow_name, int voxels, int pixels, int rounds,
        Record& record) {
    const BenchScene scene = make_scene(voxels, pixels);
    const auto fast_backend = create_backend(fast_name).backend, slow_backend = create_backend(slow_name).backend;
    const auto fast = fast_backend->prepare({scene.volume, scene.views, {}, {}});
    const auto slow = slow_backend->prepare({scene.volume, scene.views, {}, {}});
    const auto poses = poses_around(scene.truth, rounds);
    const double apart = difference(fast->render(poses[0], 0), slow->render(poses[0], 0));
    std::printf("images differ by %.1e of the maximum\n", apart);
    const double allowed = std::max(compare_tolerances(fast_backend->info(), fast->volume_layout()).image_share.value,
                                    compare_tolerances(slow_backend->info(), slow->volume_layout()).image_share.value);
    if (!(apart < allowed)) {
        std::fprintf(stderr, "the images disagree: a fast wrong answer is not a result\n");
        return 1;
    }
    std::vector<double> fast_s, slow_s, ratio;
    for (const RigidTransform& pose : poses) {
        fast_s.push_back(seconds_to_render(*fast, pose));
        slow_s.push_back(seconds_to_render(*slow, pose));
        ratio.push_back(slow_s.back() / fast_s.back());
    }
    const BackendInfo info = fast_backend->info();
    std::printf("%d^3 voxels, %d^2 pixels, joseph, %zu random poses, medians\n", voxels, pixels, poses.size());
    std::printf("%-10s %9.2f ms   %s, %d threads, %s\n", fast_name.c_str(), 1e3 * median(fast_s), info.device.c_str(),
                info.threads, info.instruction_set.c_str());
    std::printf("%-10s %9.2f ms\n", slow_name.c_str(), 1e3 * median(slow_s));
    std::printf("%s is %.1f x as fast as %s\n", fast_name.c_str(), median(ratio), slow_name.c_str());
    record.note("joseph; " + info.device + ", " + info.instruction_set);
    record.add({fast_name, info.threads, 1e3 * median(fast_s), median(ratio)});
    record.add({slow_name, slow_backend->info().threads, 1e3 * median(slow_s), 1});
    record.write();
    return 0;
}

}  // namespace
}  // namespace raylign::detail::bench

int main(int argc, char** argv) {
    const auto number = [&](int i, int fallback) { return argc > i ? std::atoi(argv[i]) : fallback; };
    return raylign::detail::bench::run_program("raylign_speedup", [&] {
        raylign::detail::bench::Record record(argc, argv, "DRRs of two backends",
                                              {"backend", "threads", "DRR, median [ms]", "times as fast"});
        return raylign::detail::bench::run(argc > 1 ? argv[1] : "cpu", argc > 2 ? argv[2] : "reference", number(3, 256),
                                           number(4, 256), number(5, 9), record);
    });
}

// Google Benchmark programs for the backends: DRR, gradient, sums, evaluate, linearize and a whole registration, on
// every backend that runs here. `--benchmark_filter=cpu.*256` picks; `--benchmark_out=FILE --benchmark_out_format=json`
// records. See README.md.

#include <benchmark/benchmark.h>

#include <map>

#include "bench/bench_scene.h"
#include "core/base/error.h"
#include "raylign/registration.h"
#include "raylign/targets.h"

namespace raylign::detail::bench {
namespace {

/// Scenes are slow to make (exact X-rays, voxelisation): each size once.
const BenchScene& scene(int n, int side_px) {
    static std::map<std::pair<int, int>, BenchScene> scenes;  // NOLINT: a cache of one single-threaded program
    const auto found = scenes.find({n, side_px});
    return found != scenes.end() ? found->second
                                 : scenes.emplace(std::pair(n, side_px), make_scene(n, side_px)).first->second;
}

std::unique_ptr<Session> session_for(const std::string& backend, const BenchScene& s,
                                     Projector projector = Projector::joseph) {
    return create_backend(backend).backend->prepare({s.volume, s.views, {projector, {}}, {}});
}

double images_per_pose(const BenchScene& s) { return static_cast<double>(s.views.size()); }

/// One DRR per iteration, a new pose each time.
void drr(benchmark::State& state, const std::string& backend, Projector projector) {
    const BenchScene& s = scene(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
    const auto session = session_for(backend, s, projector);
    const auto poses = poses_around(s.truth, 20);
    std::size_t i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(session->render(poses[i++ % poses.size()], 0));
    const double rays = static_cast<double>(state.range(1)) * static_cast<double>(state.range(1));
    state.counters["rays"] = benchmark::Counter(rays, benchmark::Counter::kIsIterationInvariantRate);
}

/// A batch of poses, both views: the optimizer's unit of work. Counters: milliseconds of each stage per image.
void evaluate(benchmark::State& state, const std::string& backend) {
    const BenchScene& s = scene(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
    const auto session = session_for(backend, s);
    const auto poses = poses_around(s.truth, static_cast<int>(state.range(2)));
    std::vector<double> costs(poses.size());
    for (auto _ : state) session->evaluate(poses, costs);
    for (const double cost : costs) {
        if (!(cost > 0 && cost < 2)) state.SkipWithError("a wrong cost: a fast wrong answer is not a result");
    }
    const double images = static_cast<double>(session->counters().evaluations) * images_per_pose(s);
    state.counters["drr_ms"] = 1e3 * session->timing().drr_s / images;
    state.counters["gradient_ms"] = 1e3 * session->timing().gradient_s / images;
    state.counters["sums_ms"] = 1e3 * session->timing().reduction_s / images;
    state.counters["poses"] =
        benchmark::Counter(static_cast<double>(poses.size()), benchmark::Counter::kIsIterationInvariantRate);
}

void linearize(benchmark::State& state, const std::string& backend) {
    const BenchScene& s = scene(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
    const auto session = session_for(backend, s);
    const auto poses = poses_around(s.truth, 20);
    std::size_t i = 0;
    Linearization result;
    try {
        for (auto _ : state) session->linearize({&poses[i++ % poses.size()], 1}, Eigen::Vector3d::Zero(), {&result, 1});
    } catch (const Error& error) {
        state.SkipWithError(error.what());
    }
}

/// From 8 mm mTRE; counters say how well and with how much work.
void whole_registration(benchmark::State& state, const std::string& name, Method method) {
    const BenchScene& s = scene(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
    const auto backend = create_backend(name).backend;
    const auto targets = default_targets_ct_mm(s.volume);
    double worst_mm = 0, evaluations = 0;
    std::uint64_t seed = 0;
    for (auto _ : state) {
        const RigidTransform start = perturbed_start(s.truth, targets, 8, ++seed);
        try {
            const RegistrationResult result = register_volume(s.volume, s.views, start, {.method = method}, *backend);
            worst_mm = std::max(worst_mm, mean_target_error_mm(result.world_from_ct, s.truth, targets));
            evaluations += static_cast<double>(result.counters.evaluations + result.counters.linearizations);
        } catch (const Error& error) {
            state.SkipWithError(error.what());
            break;
        }
    }
    if (worst_mm > s.volume.grid.spacing_mm.minCoeff() / 2) state.SkipWithError("a registration failed");
    state.counters["worst_mtre_mm"] = worst_mm;
    state.counters["evaluations"] = benchmark::Counter(evaluations, benchmark::Counter::kAvgIterations);
}

void add_backend(const std::string& name) {
    const bool slow = name == "reference";
    const auto add = [&](const std::string& what, auto function) {
        return benchmark::RegisterBenchmark((name + "/" + what).c_str(), function)
            ->Unit(benchmark::kMillisecond)
            ->UseRealTime();
    };
    using State = benchmark::State;
    for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
        auto* b = add("drr_" + std::string(projector_name(projector)), [=](State& s) { drr(s, name, projector); });
        b->Args({64, 64})->Args({128, 128})->Args({256, 256});
        if (!slow) b->Args({256, 512});
    }
    add("evaluate", [=](State& s) { evaluate(s, name); })->Args({64, 64, 12})->Args({256, 256, slow ? 1 : 12});
    if (!slow) add("evaluate", [=](State& s) { evaluate(s, name); })->Args({64, 64, 512});
    add("linearize", [=](State& s) { linearize(s, name); })->Args({64, 64})->Args({slow ? 128 : 256, slow ? 128 : 256});
    for (const Method method : {Method::steepest_descent, Method::gauss_newton}) {
        add("register_" + std::string(method_name(method)), [=](State& s) { whole_registration(s, name, method); })
            ->Args(slow ? std::vector<std::int64_t>{64, 64} : std::vector<std::int64_t>{256, 256})
            ->Iterations(slow ? 1 : 5);
    }
}

}  // namespace
}  // namespace raylign::detail::bench

int main(int argc, char** argv) {
    for (const raylign::BackendStatus& backend : raylign::backend_statuses()) {
        if (!backend.available) continue;
        raylign::detail::bench::add_backend(backend.name);
        benchmark::AddCustomContext(backend.name, backend.info.device + ", " + std::to_string(backend.info.threads) +
                                                      " threads, " + backend.info.instruction_set);
    }
    benchmark::AddCustomContext("compiler", RAYLIGN_COMPILER);
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}

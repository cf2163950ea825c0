// What an OpenGL device makes of the gl backend: one program for one step of bench/gpu/run.sh each.
//
// Usage: raylign_gpu info
//        raylign_gpu ceiling VOXELS PIXELS       texture, memory and waiting, without raylign
//        raylign_gpu calls VOXELS PIXELS [gl|as-hardware]   what linearizing two views asks of OpenGL; as-hardware:
//            what it would ask of a GPU, counted on software OpenGL
//        raylign_gpu throughput VOXELS PIXELS [BACKEND] [SECONDS]   batches of 1 to 256
//        raylign_gpu device VOXELS PIXELS        one row of the table of devices
// VOXELS and PIXELS are 256, BACKEND gl and SECONDS 0.2 where they are left out; --json FILE keeps what is printed.
// A device is chosen by RAYLIGN_GL_DEVICE, as by --device of the program.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>

#include "backends/gl/devices.h"
#include "backends/gl/with_api.h"
#include "bench/bench_scene.h"
#include "bench/gpu/ceiling.h"
#include "bench/gpu/counted_api.h"
#include "bench/program.h"
#include "bench/record.h"
#include "core/base/median.h"
#include "core/registration/level/methods.h"
#include "raylign/registration.h"
#include "raylign/targets.h"
#include "tests/support/as_hardware.h"

namespace raylign::detail::bench {
namespace {

struct Settings {
    int voxels = 256, pixels = 256;
    std::string backend = "gl";
    double seconds = 0.2;
};

std::string wanted_device() {
    const char* const name = std::getenv("RAYLIGN_GL_DEVICE");
    return name == nullptr ? "" : name;
}

double seconds_of(const std::function<void()>& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Median of at least five turns, and of as many as fit into `seconds`, after two that compile and warm up.
double median_s(double seconds, const std::function<void()>& work) {
    work();
    work();
    std::vector<double> times_s;
    double sum_s = 0;
    while (times_s.size() < 5 || sum_s < seconds) {
        times_s.push_back(seconds_of(work));
        sum_s += times_s.back();
    }
    return median(times_s);
}

/// A session and poses that are taken in turn.
struct Turns {
    const BenchScene& scene;
    std::unique_ptr<Session> session;
    std::vector<RigidTransform> poses;
    std::size_t next = 0;

    [[nodiscard]] std::span<const RigidTransform> some(std::size_t count) {
        const std::size_t first = next++ * count % (poses.size() - count + 1);
        return std::span(poses).subspan(first, count);
    }
    void render() { (void)session->render(some(1).front(), 0); }
    void evaluate(std::size_t count) {
        std::vector<double> costs(count);
        session->evaluate(some(count), costs);
    }
    void linearize(std::size_t count) {
        std::vector<Linearization> out(count);
        session->linearize(some(count), Eigen::Vector3d::Zero(), out);
    }
};

Turns turns_of(const BenchScene& scene, Backend& backend) {
    return {scene, backend.prepare({scene.volume, scene.views, {}, {}}), poses_around(scene.truth, 512)};
}

int info() {
    std::string problem;
    for (const GlDevice& d : gl_devices(problem)) {
        std::printf("%d: %s, %s, %s, 3-D %d, layers %d, %zu MiB%s%s\n", d.index, d.name.c_str(), d.vendor.c_str(),
                    d.version.c_str(), d.texture_3d_voxels, d.texture_layers, d.memory_bytes >> 20,
                    d.problem.empty() ? "" : ": ", d.problem.c_str());
    }
    if (!problem.empty()) std::printf("%s\n", problem.c_str());
    return problem.empty() ? 0 : 1;
}

/// Images at once that fill a device: one is latency's business, many are throughput's.
int many_images(const gl::Context& context) { return context.device().software ? 1 : 64; }

int ceiling(const Settings& settings, int argc, char** argv) {
    Record record(argc, argv, "What an OpenGL device can do",
                  {"asked for", "texels", "one image [10^9/s]", "many images [10^9/s]"});
    const auto context = gl::open_device(gl::load_api(), {wanted_device(), true});
    const gl::Current current(*context);
    record.note(context->device().renderer);
    std::printf("%s\n", context->device().renderer.c_str());
    CeilingScene scene{settings.voxels, settings.pixels, 1, false};
    for (const bool is_float : {false, true}) {
        for (const Fetch fetch : kFetches) {
            scene.float_texels = is_float;
            scene.images = 1;
            const double one = 1e-9 * samples_per_s(*context, fetch, scene);
            scene.images = many_images(*context);
            const double many = 1e-9 * samples_per_s(*context, fetch, scene);
            std::printf("%-32s %-7s %8.2f 10^9 samples/s of one image, %8.2f of %d\n", fetch_name(fetch).data(),
                        is_float ? "float32" : "int16", one, many, scene.images);
            record.add({std::string(fetch_name(fetch)), std::string(is_float ? "float32" : "int16"), one, many});
        }
    }
    const std::size_t bytes = (context->device().software ? std::size_t{16} : std::size_t{256}) << 20;
    const double copied = 1e-9 * copied_bytes_per_s(*context, bytes);
    std::printf("copying by a shader %.1f GB/s; a dispatch and the wait for it %.1f us\n", copied,
                1e6 * round_trip_s(*context));
    record.add({std::string("bytes copied"), std::string(), copied, copied});
    record.write();
    return 0;
}

/// Of OpenGL, for one linearize of all views at one pose, warm.
struct Asked {
    double calls = 0, dispatches = 0, waits = 0;
};

/// Functions that count their calls; `backend` "as-hardware" makes software OpenGL pass for a GPU.
gl::Api counted_api(const Settings& settings) {
    const gl::Api api = gl::load_api();
    return counted(settings.backend == "as-hardware" ? test::as_hardware(api) : api);
}

Asked asked_by_linearize(const Settings& settings, const BenchScene& scene, bool is_listed) {
    const auto backend = gl::make_gl_backend(counted_api(settings), {.device = wanted_device()});
    Turns turns = turns_of(scene, *backend);
    for (int i = 0; i < 5; ++i) turns.linearize(1);
    constexpr int kTurns = 20;
    reset_calls();
    for (int i = 0; i < kTurns; ++i) turns.linearize(1);
    const auto a_turn = [](std::int64_t count) { return static_cast<double>(count) / kTurns; };
    if (is_listed) {
        std::printf("linearize, 1 pose, %zu views, %d^3 and %d^2: calls each\n", scene.views.size(), settings.voxels,
                    settings.pixels);
        for (const Calls& made : calls()) std::printf("%-28s %7.2f\n", made.name.c_str(), a_turn(made.count));
    }
    return {a_turn(all_calls()), a_turn(calls_of("glDispatchCompute")), a_turn(calls_of("glClientWaitSync"))};
}

/// For each linearization of a search by Levenberg-Marquardt from 8 mm off, warm.
Asked asked_by_descent(const Settings& settings, const BenchScene& scene, Solver solver) {
    const auto backend = gl::make_gl_backend(counted_api(settings), {.device = wanted_device(), .solver = solver});
    const auto session = backend->prepare({scene.volume, scene.views, {}, {}});
    const LevelProblem problem{
        .session = *session,
        .start_world_from_ct = perturbed_start(scene.truth, default_targets_ct_mm(scene.volume), 8, 1),
        .extent = object_extent(scene.volume),
        .pixel_at_object_mm = 1,
        .initial_step_mm = 1,
        .step_tolerance_mm = 1e-3,
        .cost_tolerance = 1e-10,
        .max_iterations = 50,
        .before_batch = [] {}};
    (void)run_gauss_newton(problem, {});
    const auto before = session->counters().linearizations;
    reset_calls();
    (void)run_gauss_newton(problem, {});
    const auto count = static_cast<double>(session->counters().linearizations - before);
    const auto each = [&](std::int64_t made) { return static_cast<double>(made) / count; };
    return {each(all_calls()), each(calls_of("glDispatchCompute") + calls_of("glDispatchComputeIndirect")),
            each(calls_of("glClientWaitSync"))};
}

int count_calls(const Settings& settings, int argc, char** argv) {
    Record record(argc, argv, "What a linearization asks of OpenGL", {"of", "calls", "dispatches", "waits"});
    const BenchScene scene = make_scene(settings.voxels, settings.pixels);
    const auto note = [&](const std::string& of, const Asked& asked) {
        std::printf("%s: %.1f calls, %.1f dispatches, %.1f waits\n", of.c_str(), asked.calls, asked.dispatches,
                    asked.waits);
        record.add({of, asked.calls, asked.dispatches, asked.waits});
    };
    note("linearize", asked_by_linearize(settings, scene, true));
    note("a search, solved on the host", asked_by_descent(settings, scene, Solver::host));
    note("a search, solved on the device", asked_by_descent(settings, scene, Solver::device));
    record.write();
    return 0;
}

BackendOptions options_of() {
    BackendOptions options;
    options.gl.device = options.gl_2006.device = wanted_device();
    return options;
}

int throughput(const Settings& settings, int argc, char** argv) {
    Record record(argc, argv, "Poses a second of two views, by batch",
                  {"work", "poses at once", "time, median [ms]", "poses [1/s]", "DRR [us an image]",
                   "filter [us an image]", "sums [us an image]", "transfer [us an image]"});
    const BenchScene scene = make_scene(settings.voxels, settings.pixels);
    const auto backend = create_backend(settings.backend, options_of()).backend;
    record.note(backend->info().device);
    std::printf("%s on %s, timed by %s\n", settings.backend.c_str(), backend->info().device.c_str(),
                backend->info().timing.c_str());
    Turns turns = turns_of(scene, *backend);
    for (const bool derivatives : {false, true}) {
        if (derivatives && !backend->info().has_derivatives) break;
        double time_s = 0;
        for (int batch = 1; batch <= 256 && time_s < 4 * settings.seconds; batch *= 2) {
            const auto work = [&] { derivatives ? turns.linearize(batch) : turns.evaluate(batch); };
            const auto before = turns.session->timing();
            const auto done = turns.session->counters();
            time_s = median_s(settings.seconds, work);
            const auto after = turns.session->timing();
            const auto now = turns.session->counters();
            const double images =
                static_cast<double>(scene.views.size()) *
                static_cast<double>(now.evaluations + now.linearizations - done.evaluations - done.linearizations);
            const std::string name = derivatives ? "linearize" : "evaluate";
            record.add({name, batch, 1e3 * time_s, batch / time_s, 1e6 * (after.drr_s - before.drr_s) / images,
                        1e6 * (after.gradient_s - before.gradient_s) / images,
                        1e6 * (after.reduction_s - before.reduction_s) / images,
                        1e6 * (after.transfer_s - before.transfer_s) / images});
            std::printf("%-10s %3d at once: %10.3f ms, %10.1f poses/s; us an image: drr %.2f, sums %.2f, rest %.2f\n",
                        name.c_str(), batch, 1e3 * time_s, batch / time_s, 1e6 * (after.drr_s - before.drr_s) / images,
                        1e6 * (after.gradient_s + after.reduction_s - before.gradient_s - before.reduction_s) / images,
                        1e6 * (after.transfer_s - before.transfer_s) / images);
            std::fflush(stdout);
        }
    }
    record.write();
    return 0;
}

/// From 8 mm off, six starts; the first one compiles and does not count.
double registration_ms(const BenchScene& scene, Backend& backend) {
    const auto targets = default_targets_ct_mm(scene.volume);
    std::vector<double> times_s;
    for (int i = 0; i < 7; ++i) {
        const RigidTransform start = perturbed_start(scene.truth, targets, 8, 1 + i);
        times_s.push_back(seconds_of([&] {
            const RegistrationResult result = register_volume(scene.volume, scene.views, start, {}, backend);
            std::printf("registration %d: %.4f mm off, %s\n", i,
                        mean_target_error_mm(result.world_from_ct, scene.truth, targets), result.ok ? "ok" : "doubted");
        }));
    }
    times_s.erase(times_s.begin());
    return 1e3 * median(times_s);
}

int device(const Settings& settings, int argc, char** argv) {
    Record record(argc, argv, "Devices",
                  {"device", "DRR [us]", "evaluate, 1 pose [us]", "of 64, each [us]", "linearize, 1 pose [us]",
                   "of 64, each [us]", "samples of the ceiling [%]", "calls, dispatches, waits",
                   "biplane registration [ms]", "solved on the device [ms]"});
    const BenchScene scene = make_scene(settings.voxels, settings.pixels);
    const auto backend = make_gl_backend(GlOptions{.device = wanted_device()});
    Turns turns = turns_of(scene, *backend);
    const double drr_s = median_s(settings.seconds, [&] { turns.render(); });
    const double evaluate_s = median_s(settings.seconds, [&] { turns.evaluate(1); });
    const double many_s = median_s(settings.seconds, [&] { turns.evaluate(64); }) / 64;
    const double linearize_s = median_s(settings.seconds, [&] { turns.linearize(1); });
    const double many_linearize_s = median_s(settings.seconds, [&] { turns.linearize(64); }) / 64;
    const auto context = gl::open_device(gl::load_api(), {wanted_device(), true});
    double most_per_s = 0;
    {
        const gl::Current current(*context);
        most_per_s =
            samples_per_s(*context, Fetch::texture, {settings.voxels, settings.pixels, many_images(*context), false});
    }
    const double samples =
        static_cast<double>(scene.views.size()) * settings.voxels * settings.pixels * settings.pixels;
    const Asked asked = asked_by_linearize(settings, scene, false);
    char counts[64];
    std::snprintf(counts, sizeof counts, "%.0f, %.0f, %.0f", asked.calls, asked.dispatches, asked.waits);
    const double ms = registration_ms(scene, *backend);
    const auto solving = make_gl_backend(GlOptions{.device = wanted_device(), .solver = Solver::device});
    const double solved_ms = registration_ms(scene, *solving);
    const double share = 100 * samples / many_s / most_per_s;
    std::printf(
        "%s: DRR %.1f us, evaluate %.1f (%.1f of 64), linearize %.1f (%.1f of 64), %.1f %% of the ceiling, "
        "%s calls, registration %.2f ms (%.2f, solved on the device)\n",
        backend->info().device.c_str(), 1e6 * drr_s, 1e6 * evaluate_s, 1e6 * many_s, 1e6 * linearize_s,
        1e6 * many_linearize_s, share, counts, ms, solved_ms);
    record.add({backend->info().device, 1e6 * drr_s, 1e6 * evaluate_s, 1e6 * many_s, 1e6 * linearize_s,
                1e6 * many_linearize_s, share, std::string(counts), ms, solved_ms});
    record.write();
    return 0;
}

int run(int argc, char** argv) {
    const std::string mode = argc > 1 ? argv[1] : "";
    int plain = argc;  // arguments before --json
    for (int i = argc - 1; i > 1; --i) {
        if (std::string(argv[i]) == "--json") plain = i;
    }
    const auto text = [&](int i, const std::string& fallback) { return i < plain ? std::string(argv[i]) : fallback; };
    const Settings settings{std::atoi(text(2, "256").c_str()), std::atoi(text(3, "256").c_str()), text(4, "gl"),
                            std::atof(text(5, "0.2").c_str())};
    if (settings.voxels < 8 || settings.pixels < 8 || settings.pixels % 8 != 0) {
        throw bad_value("sizes", text(2, "") + " and " + text(3, ""), "8 and more, pixels a multiple of 8");
    }
    if (mode == "info") return info();
    if (mode == "ceiling") return ceiling(settings, argc, argv);
    if (mode == "calls") return count_calls(settings, argc, argv);
    if (mode == "throughput") return throughput(settings, argc, argv);
    if (mode == "device") return device(settings, argc, argv);
    throw bad_value("mode", mode, "info, ceiling, calls, throughput or device");
}

}  // namespace
}  // namespace raylign::detail::bench

int main(int argc, char** argv) {
    using namespace raylign::detail::bench;
    return run_program("raylign_gpu", [&] { return run(argc, argv); });
}

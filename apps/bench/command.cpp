#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/bench/measure.h"
#include "apps/report_page/page_files.h"
#include "apps/report_page/report_page.h"
#include "apps/shared/commands.h"
#include "apps/shared/help.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/machine.h"
#include "apps/shared/manifest.h"
#include "apps/shared/progress_bar.h"
#include "apps/study/options.h"
#include "core/base/error.h"
#include "core/io/files/output.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

using Json = nlohmann::ordered_json;

struct BenchFlags {
    VolumeFlags volume;  ///< file "" = the spine phantom
    EngineFlags engine;  ///< backend: a list with commas; "" = all but reference
    std::filesystem::path output;
    std::string method = "steepest-descent,gauss-newton";
    int size = 256, pixels = 256, repeats = 5;
    bool no_scaling = false, quiet = false, json = false;
};

struct Engine {
    std::string name;
    std::unique_ptr<Backend> backend;
};

struct BenchRun {
    std::vector<Engine> engines;
    Json left_out = Json::array(), registrations = Json::array(), scaling = Json::array();
};

std::vector<std::string> names_of(const BenchFlags& flags) {
    if (!flags.engine.backend.empty()) return parse_list(flags.engine.backend, "--backend");
    std::vector<std::string> names = backend_names();
    std::erase(names, "reference");  // it would take minutes, so it runs only where it is named
    return names;
}

void make_engines(const BenchFlags& flags, BenchRun& run) {
    for (const std::string& name : names_of(flags)) {
        EngineFlags one = flags.engine;
        one.backend = name;
        try {
            run.engines.push_back({name, choose_backend(one).backend});
        } catch (const Error& error) {
            if (!flags.engine.backend.empty()) throw;
            run.left_out.push_back({{"backend", name}, {"reason", error.what()}});
        }
    }
    if (run.engines.empty()) throw Error("no backend can run here, see `raylign info`", ErrorKind::unavailable);
}

Json json_of(const BenchRegistration& r) {
    return {{"backend", r.backend},
            {"method", r.method},
            {"ok", r.ok},
            {"problem", r.problem},
            {"time_s",
             {{"prepare", r.timing.prepare_s},
              {"drr", r.timing.drr_s},
              {"gradient", r.timing.gradient_s},
              {"reduction", r.timing.reduction_s},
              {"transfer", r.timing.transfer_s},
              {"optimizer", r.optimizer_s}}},
            {"total_s", r.total_s},
            {"iterations", r.iterations},
            {"step_s", r.total_s / std::max(1, r.iterations)},
            {"evaluations", r.evaluations},
            {"linearizations", r.linearizations},
            {"bytes_to_host", r.bytes_to_host},
            {"engine_volume_bytes", r.engine_volume_bytes},
            {"initial_mtre_mm", r.initial_mtre_mm},
            {"final_mtre_mm", r.final_mtre_mm}};
}

void add_point(BenchRun& run, const std::string& what, double x, const std::string& unit, const std::string& name,
               const BenchPoint& point) {
    run.scaling.push_back({{"what", what},
                           {"x", x},
                           {"unit", unit},
                           {"backend", name},
                           {"pose_ms", point.pose_ms},
                           {"spread_ms", point.spread_ms},
                           {"rays", point.rays},
                           {"engine_volume_bytes", point.engine_volume_bytes}});
}

/// 1, 2, 4, ... up to `most`, and `most` itself.
std::vector<int> doublings(int first, int most) {
    std::vector<int> list;
    for (int n = first; n < most; n *= 2) list.push_back(n);
    list.push_back(most);
    return list;
}

class Scaling {
public:
    Scaling(const BenchFlags& flags, BenchRun& run, ProgressBar& bar) : flags_(flags), run_(run), bar_(bar) {}

    void measure() {
        const int size = flags_.size, pixels = flags_.pixels, batch = 12;
        for (const int n : doublings(std::min(64, size), size)) {
            point("volume", n, "voxels a side", phantom_scene(n, pixels, 2), batch);
        }
        for (const int p : doublings(std::min(64, pixels), 2 * pixels)) {
            point("detector", p, "pixels a side", phantom_scene(size, p, 2), batch);
        }
        for (const int views : {1, 2, 3, 4}) point("views", views, "views", phantom_scene(size, pixels, views), batch);
        const BenchScene scene = phantom_scene(size, pixels, 2);
        for (const int poses : {1, 4, 12, 48}) point("batch", poses, "poses at once", scene, poses);
        threads(scene);
    }

private:
    void point(const std::string& what, int x, const std::string& unit, const BenchScene& scene, int batch) {
        for (const Engine& engine : run_.engines) {
            stop_if_interrupted();
            bar_.draw("scaling with " + what + ": " + std::to_string(x) + " " + unit + ", " + engine.name);
            add_point(run_, what, x, unit, engine.name, time_poses(scene, *engine.backend, batch, flags_.repeats));
        }
    }
    void threads(const BenchScene& scene) {
        const bool has_cpu = std::ranges::find(run_.engines, "cpu", &Engine::name) != run_.engines.end();
        const int cores = this_machine().cores;
        if (!has_cpu || cores < 2) return;
        for (const int count : doublings(1, cores)) {
            EngineFlags flags = flags_.engine;
            flags.backend = "cpu";
            flags.threads = count;
            bar_.draw("scaling with threads: " + std::to_string(count));
            add_point(run_, "threads", count, "threads", "cpu",
                      time_poses(scene, *choose_backend(flags).backend, 12, flags_.repeats));
        }
    }

    const BenchFlags& flags_;
    BenchRun& run_;
    ProgressBar& bar_;
};

std::string bench_json(const BenchFlags& flags, const BenchScene& scene, const BenchRun& run,
                       const std::vector<std::filesystem::path>& files, const Invocation& invocation) {
    Json report = {{"raylign", RAYLIGN_VERSION}, {"command", invocation.command_line}};
    const Eigen::Vector3i& n = scene.volume.grid.size;
    const Eigen::Vector3d& mm = scene.volume.grid.spacing_mm;
    report["scene"] = {{"name", scene.name},
                       {"volume_size", {n.x(), n.y(), n.z()}},
                       {"spacing_mm", {mm.x(), mm.y(), mm.z()}},
                       {"views", scene.views.size()},
                       {"image_size_px", {flags.pixels, flags.pixels}}};
    report["repeats"] = flags.repeats;
    report["registrations"] = run.registrations;
    report["scaling"] = run.scaling;
    report["paper"] = Json::parse(paper_2006());
    report["peak_memory_bytes"] = peak_memory_bytes();
    report["left_out"] = run.left_out;
    report["backends"] = Json::array();
    for (const Engine& e : run.engines) report["backends"].push_back(Json::parse(backend_json(e.backend->info())));
    report["machine"] = Json::parse(machine_json());
    report["inputs"] = Json::parse(inputs_json(files));
    return report.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string bench_table(const BenchRun& run) {
    std::string text;
    char line[320];
    std::snprintf(line, sizeof line, "%-12s %-17s %8s %8s %8s %8s %8s %6s %8s %10s %9s\n", "engine", "method", "DRR s",
                  "grad. s", "NCC s", "transf.s", "step ms", "steps", "total s", "read back", "mTRE mm");
    text += line;
    for (const Json& r : run.registrations) {
        const Json& t = r["time_s"];
        std::snprintf(line, sizeof line, "%-12s %-17s %8.3f %8.3f %8.3f %8.3f %8.2f %6d %8.3f %10lld %9.4f%s\n",
                      r["backend"].get<std::string>().c_str(), r["method"].get<std::string>().c_str(),
                      t["drr"].get<double>(), t["gradient"].get<double>(), t["reduction"].get<double>(),
                      t["transfer"].get<double>(), 1e3 * r["step_s"].get<double>(), r["iterations"].get<int>(),
                      r["total_s"].get<double>(), r["bytes_to_host"].get<long long>(), r["final_mtre_mm"].get<double>(),
                      r["ok"].get<bool>() ? "" : "  FAILED");
        text += line;
    }
    for (const Json& s : run.scaling) {
        std::snprintf(line, sizeof line, "%-12s %-10s %5.0f %-14s %10.3f ms a pose\n",
                      s["backend"].get<std::string>().c_str(), s["what"].get<std::string>().c_str(),
                      s["x"].get<double>(), s["unit"].get<std::string>().c_str(), s["pose_ms"].get<double>());
        text += line;
    }
    return text;
}

void check(const BenchFlags& flags) {
    DrrOptions shared;  // the same flags obey the same rules
    shared.volume = flags.volume;
    shared.engine = flags.engine;
    settle_conflicts(shared);
    const auto in_range = [](const char* option, int value, int low, int high) {
        if (value >= low && value <= high) return;
        throw bad_value(option, std::to_string(value),
                        "in [" + std::to_string(low) + ", " + std::to_string(high) + "]");
    };
    in_range("--size", flags.size, 16, 1024);
    in_range("--pixels", flags.pixels, 32, 4096);
    in_range("--repeat", flags.repeats, 1, 1000);
    refuse_to_overwrite({flags.volume.file}, flags.output, {"bench.json", "bench.html"});
}

int run_bench(const BenchFlags& flags, const Invocation& invocation) {
    check(flags);
    std::vector<Method> methods;
    for (const std::string& name : parse_list(flags.method, "--method")) methods.push_back(method_from_name(name));
    BenchRun run;
    make_engines(flags, run);
    std::vector<std::filesystem::path> files;
    BenchScene scene;
    if (flags.volume.file.empty()) {
        scene = phantom_scene(flags.size, flags.pixels, 2);
    } else {
        VolumeFile file = read_volume(flags.volume.file, volume_read_options(flags.volume));
        files = file.files;
        scene = ct_scene(std::move(file.volume), flags.pixels, 2, flags.volume.file.filename().string());
    }
    OutputFolder folder(flags.output);
    bool all_ok = true;
    {
        ProgressBar bar(flags.quiet ? ProgressBar::Show::never : ProgressBar::Show::on_terminals);
        for (const Engine& engine : run.engines) {
            for (const Method method : methods) {
                stop_if_interrupted();
                bar.draw("registration by " + engine.name + ", " + std::string(method_name(method)));
                const int repeats = engine.name == "reference" ? 1 : flags.repeats;
                const BenchRegistration timed = time_registration(scene, *engine.backend, method, repeats);
                all_ok = all_ok && timed.ok;
                run.registrations.push_back(json_of(timed));
            }
        }
        if (!flags.no_scaling) Scaling(flags, run, bar).measure();
    }
    const std::string json = bench_json(flags, scene, run, files, invocation);
    write_text(folder.stage("bench.json"), json);
    write_text(folder.stage("bench.html"), report_page("bench", json, {}));
    folder.commit();
    if (flags.json) {
        std::cout << json;
    } else if (!flags.quiet) {
        std::cout << bench_table(run) << "written: " << flags.output.string() << ": bench.html bench.json\n";
    }
    return all_ok ? 0 : 1;
}

}  // namespace

void add_bench_command(CLI::App& app, Job& job) {
    const auto flags = std::make_shared<BenchFlags>();
    flags->engine.backend.clear();
    CLI::App& command = *app.add_subcommand("bench", "Time registrations and their parts on this machine");
    add_volume_flags(command, flags->volume);
    command.get_option("--volume")
        ->required(false)
        ->option_text("FILE")
        ->description("CT to register, as in register; default: the spine phantom");
    describe(command.add_option("--size", flags->size, "Voxels a side of the spine phantom, 16 to 1024; default 256"),
             "N", kInputGroup);
    describe(command.add_option("--pixels", flags->pixels, "Pixels a side of the two X-rays, 32 to 4096; default 256"),
             "N", kInputGroup);
    describe(command.add_option("--method", flags->method, "With commas; default steepest-descent,gauss-newton"),
             "NAMES", kMethodGroup);
    describe(command.add_option("--repeat", flags->repeats, "Repetitions, of which the median counts; default 5"), "N",
             kMethodGroup);
    command.add_flag("--no-scaling", flags->no_scaling, "Leave out the runs against size, views, batch, threads")
        ->group(kMethodGroup);
    add_engine_flags(command, flags->engine);
    command.get_option("--backend")
        ->description(
            "Names with commas; default: all that run here but reference, which\n"
            "takes minutes");
    describe(command.add_option("-o,--output", flags->output, "Folder for bench.html and bench.json")->required(),
             "DIR (required)", kOutputGroup);
    command.add_flag("--json", flags->json, "Print bench.json and nothing else; default off")->group(kOutputGroup);
    command.add_flag("--quiet", flags->quiet, "No progress, no table; default off")->group(kOutputGroup);
    finish_command(command,
                   "  raylign bench -o bench\n"
                   "  raylign bench -v ct.nii.gz --backend cpu,reference --no-scaling -o bench");
    command.callback(
        [flags, &job] { job = [flags](const Invocation& invocation) { return run_bench(*flags, invocation); }; });
}

}  // namespace raylign::detail::apps

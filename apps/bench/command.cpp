#include <algorithm>
#include <iostream>

#include "apps/bench/report.h"
#include "apps/report_page/report_page.h"
#include "apps/shared/commands.h"
#include "apps/shared/help.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/machine.h"
#include "apps/shared/outputs.h"
#include "apps/shared/parse.h"
#include "apps/shared/progress_bar.h"
#include "core/base/error.h"
#include "core/io/files/output.h"

namespace raylign::detail::apps {
namespace {

struct BenchFlags {
    VolumeFlags volume;    ///< file "" = the spine phantom
    BackendFlags backend;  ///< name: a list with commas; "" = all but reference
    std::string method = "steepest-descent,gauss-newton";
    int size = 256, pixels = 256, repeats = 5;
    bool no_scaling = false;
    OutputFlags output;
};

std::vector<std::string> names_of(const BenchFlags& flags) {
    if (!flags.backend.name.empty()) return parse_list(flags.backend.name, "--backend");
    std::vector<std::string> names = backend_names();
    std::erase(names, "reference");  // it would take minutes, so it runs only where it is named
    return names;
}

void make_backends(const BenchFlags& flags, BenchRun& run) {
    for (const std::string& name : names_of(flags)) {
        BackendFlags one = flags.backend;
        one.name = name;
        try {
            run.backends.push_back({name, choose_backend(one).backend});
        } catch (const Error& error) {
            if (!flags.backend.name.empty()) throw;
            run.left_out.push_back({name, error.what()});
        }
    }
    if (run.backends.empty()) throw Error("no backend can run here, see `raylign info`", ErrorKind::unavailable);
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
        for (const BenchBackend& backend : run_.backends) {
            stop_if_interrupted();
            bar_.draw("scaling with " + what + ": " + std::to_string(x) + " " + unit + ", " + backend.name);
            run_.scaling.push_back(
                {what, x, unit, backend.name, time_poses(scene, *backend.backend, batch, flags_.repeats)});
        }
    }
    void threads(const BenchScene& scene) {
        const bool has_cpu = std::ranges::find(run_.backends, "cpu", &BenchBackend::name) != run_.backends.end();
        const int cores = this_machine().cores;
        if (!has_cpu || cores < 2) return;
        for (const int count : doublings(1, cores)) {
            BackendFlags flags = flags_.backend;
            flags.name = "cpu";
            flags.threads = count;
            bar_.draw("scaling with threads: " + std::to_string(count));
            run_.scaling.push_back({"threads", count, "threads", "cpu",
                                    time_poses(scene, *choose_backend(flags).backend, 12, flags_.repeats)});
        }
    }

    const BenchFlags& flags_;
    BenchRun& run_;
    ProgressBar& bar_;
};

void check(const BenchFlags& flags) {
    settle_conflicts(flags.volume);
    settle_conflicts(flags.backend);
    const auto in_range = [](const char* option, int value, int low, int high) {
        if (value >= low && value <= high) return;
        throw bad_value(option, std::to_string(value),
                        "in [" + std::to_string(low) + ", " + std::to_string(high) + "]");
    };
    in_range("--size", flags.size, 16, 1024);
    in_range("--pixels", flags.pixels, 32, 4096);
    in_range("--repeat", flags.repeats, 1, 1000);
    refuse_to_overwrite({flags.volume.file}, flags.output.folder, {"bench.json", "bench.html"});
}

int run_bench(const BenchFlags& flags, const Invocation& invocation) {
    check(flags);
    std::vector<Method> methods;
    for (const std::string& name : parse_list(flags.method, "--method")) methods.push_back(method_from_name(name));
    BenchRun run{.invocation = invocation, .repeats = flags.repeats, .pixels = flags.pixels};
    make_backends(flags, run);
    BenchScene scene;
    if (flags.volume.file.empty()) {
        scene = phantom_scene(flags.size, flags.pixels, 2);
    } else {
        VolumeFile file = read_volume(flags.volume.file, volume_read_options(flags.volume));
        run.inputs = hash_inputs(file.files);
        scene = ct_scene(std::move(file.volume), flags.pixels, 2, flags.volume.file.filename().string());
    }
    OutputFolder folder(flags.output.folder);
    bool all_ok = true;
    {
        ProgressBar bar(flags.output);
        for (const BenchBackend& backend : run.backends) {
            for (const Method method : methods) {
                stop_if_interrupted();
                bar.draw("registration by " + backend.name + ", " + std::string(method_name(method)));
                const int repeats = backend.name == "reference" ? 1 : flags.repeats;
                run.registrations.push_back(time_registration(scene, *backend.backend, method, repeats));
                all_ok = all_ok && run.registrations.back().ok;
            }
        }
        if (!flags.no_scaling) Scaling(flags, run, bar).measure();
    }
    const std::string json = bench_json(run, scene);
    write_text(folder.stage("bench.json"), json);
    write_text(folder.stage("bench.html"), report_page("bench", json, {}));
    folder.commit();
    if (flags.output.json) {
        std::cout << json;
    } else if (!flags.output.quiet) {
        std::cout << bench_table(run) << "written: " << flags.output.folder.string() << ": bench.html bench.json\n";
    }
    return all_ok ? 0 : 1;
}

}  // namespace

void add_bench_command(CLI::App& app, Job& job) {
    const auto flags = std::make_shared<BenchFlags>();
    flags->backend.name.clear();
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
    add_backend_flags(command, flags->backend);
    command.get_option("--backend")
        ->description(
            "Names with commas; default: all that run here but reference, which\n"
            "takes minutes");
    add_output_flags(command, flags->output,
                     {.folder = "Folder for bench.html and bench.json",
                      .json_file = "bench.json",
                      .quiet = "No progress, no table"});
    finish_command(command,
                   "  raylign bench -o bench\n"
                   "  raylign bench -v ct.nii.gz --backend cpu,reference --no-scaling -o bench");
    command.callback(
        [flags, &job] { job = [flags](const Invocation& invocation) { return run_bench(*flags, invocation); }; });
}

}  // namespace raylign::detail::apps

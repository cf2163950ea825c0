#include <algorithm>
#include <iostream>

#include "apps/compare/report.h"
#include "apps/report_page/report_page.h"
#include "apps/shared/append.h"
#include "apps/shared/commands.h"
#include "apps/shared/help.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/object_volume.h"
#include "apps/shared/options.h"
#include "apps/shared/outputs.h"
#include "apps/shared/parse.h"
#include "apps/shared/progress_bar.h"
#include "apps/shared/simulated_views.h"
#include "core/base/error.h"
#include "core/io/files/output.h"
#include "raylign/io/pose.h"
#include "raylign/io/views.h"
#include "raylign/targets.h"

namespace raylign::detail::apps {
namespace {

struct CompareFlags {
    VolumeFlags volume;
    BackendFlags backend;  ///< name: a list with commas; "" = all that run here
    std::filesystem::path views, pose, targets;
    std::string method = "auto", metric = "gc";
    CompareOptions compare;
    OutputFlags output;
};

/// The oracle first: reference where it is asked for, else the first named.
std::vector<std::string> names_of(const CompareFlags& flags) {
    std::vector<std::string> names;
    if (!flags.backend.name.empty()) {
        names = parse_list(flags.backend.name, "--backends");
    } else {
        for (const BackendStatus& status : backend_statuses()) {
            if (status.available) names.push_back(status.name);
        }
    }
    const auto oracle = std::ranges::find(names, "reference");
    if (oracle != names.end()) std::rotate(names.begin(), oracle, oracle + 1);
    return names;
}

struct CompareInputs {
    Volume volume;
    std::vector<View> views;
    RigidTransform world_from_ct;
    std::vector<Eigen::Vector3d> targets;
};

CompareInputs read_inputs(const CompareFlags& flags, CompareRun& run) {
    CompareInputs inputs;
    inputs.world_from_ct = read_pose(flags.pose);
    run.files = {flags.pose};
    ViewsFile views = read_views(flags.views, ReadImages::if_named);
    inputs.views = std::move(views.views);
    append(run.files, views.files);
    run.notes = views.notes;
    if (!flags.targets.empty()) {
        inputs.targets = read_targets(flags.targets);
        run.files.push_back(flags.targets);
    }
    VolumeFile volume =
        read_object_volume(flags.volume, inputs.views, [&](const VoxelGrid&) { return inputs.world_from_ct; });
    inputs.world_from_ct = read_pose(flags.pose, volume.files.front());
    inputs.volume = std::move(volume.volume);
    inputs.volume.surface.reset();  // backends are compared by what they make of voxels
    append(run.files, volume.files);
    append(run.notes, volume.notes);
    run.hashes = hash_inputs(run.files);
    stop_if_interrupted();
    if (inputs.targets.empty()) inputs.targets = default_targets_ct_mm(inputs.volume);
    run.simulation =
        simulate_missing_images(inputs.volume, inputs.views, inputs.world_from_ct, run.options.render.projector).how;
    return inputs;
}

std::vector<PageOverlay> pictures(const CompareInputs& inputs, const std::vector<NamedBackend>& backends,
                                  const CompareRun& run, const std::filesystem::path& scratch) {
    std::vector<PageOverlay> overlays;
    for (const View& view : inputs.views) {
        overlays.push_back({view.name, page_layer("X-ray", view.image, view.weights, scratch), {}});
    }
    for (const NamedBackend& backend : backends) {
        stop_if_interrupted();
        const auto session = backend.backend->prepare({inputs.volume, inputs.views, run.options.render, {}});
        for (std::size_t v = 0; v < inputs.views.size(); ++v) {
            overlays[v].layers.push_back(page_layer("DRR by " + backend.name, session->render(inputs.world_from_ct, v),
                                                    inputs.views[v].weights, scratch));
        }
    }
    return overlays;
}

Comparison compare_with_progress(const CompareInputs& inputs, const std::vector<NamedBackend>& backends,
                                 CompareOptions options, const OutputFlags& output) {
    ProgressBar bar(output);
    options.progress = [&bar](const std::string& stage, double fraction) {
        bar.draw(std::to_string(static_cast<int>(100 * fraction)) + "%  " + stage);
    };
    options.stop = interrupt_token();
    Comparison comparison =
        compare_backends(inputs.volume, inputs.views, inputs.world_from_ct, inputs.targets, backends, options);
    stop_if_interrupted();
    return comparison;
}

void check(const CompareFlags& flags) {
    settle_conflicts(flags.volume);
    settle_conflicts(flags.backend);
    refuse_to_overwrite({flags.volume.file, flags.views, flags.pose, flags.targets}, flags.output.folder,
                        {"compare.json", "compare.html"});
}

int run_compare(const CompareFlags& flags, const Invocation& invocation) {
    check(flags);
    CompareRun run{invocation, {}, {}, flags.compare, {}, {}, {}};
    run.options.method = method_from_name(flags.method);
    run.options.similarity.metric = metric_from_name(flags.metric);
    run.options.render = render_settings(flags.backend);
    std::vector<std::unique_ptr<Backend>> owned;
    std::vector<NamedBackend> backends;
    for (const std::string& name : names_of(flags)) {
        BackendFlags one = flags.backend;
        one.name = name;
        owned.push_back(choose_backend(one).backend);
        run.backends.push_back(owned.back()->info());
        backends.push_back({run.backends.back().name, owned.back().get()});
    }
    const CompareInputs inputs = read_inputs(flags, run);
    OutputFolder folder(flags.output.folder);
    run.comparison = compare_with_progress(inputs, backends, run.options, flags.output);
    const std::string json = compare_json(run);
    write_text(folder.stage("compare.json"), json);
    const std::filesystem::path page = folder.stage("compare.html");
    write_text(page, report_page("compare", json, pictures(inputs, backends, run, page.parent_path())));
    stop_if_interrupted();
    folder.commit();
    if (flags.output.json) {
        std::cout << json;
    } else if (!flags.output.quiet) {
        std::cout << compare_table(run) << "written: " << flags.output.folder.string()
                  << ": compare.html compare.json\n";
    }
    return run.comparison.agrees() ? 0 : 1;
}

void add_compare_flags(CLI::App& command, CompareFlags& flags) {
    CompareOptions& compare = flags.compare;
    describe(command.add_option("--poses", compare.poses, "Random poses compared, the given one first; default 20"),
             "N", kMethodGroup);
    describe(command.add_option("--spread", compare.spread_mm, "Largest mTRE of the random poses in mm; default 10"),
             "MM", kMethodGroup);
    describe(command.add_option("--longest-side", compare.longest_side_px,
                                "Images are halved to this for all but two DRRs; default 128"),
             "PX", kMethodGroup);
    describe(command.add_option("--registrations", compare.registrations,
                                "Whole registrations from the same random starts; default 3"),
             "N", kMethodGroup);
    describe(command.add_option("--method", flags.method, "Of the registrations, as in register; default auto"), "NAME",
             kMethodGroup);
    describe(command.add_option("--metric", flags.metric, "gc or ncc; default gc"), "NAME", kMethodGroup);
    add_seed_flag(command, compare.seed, "Of poses and starts");
    add_backend_flags(command, flags.backend);
    command.remove_option(command.get_option("--backend"));
    describe(command.add_option("--backends", flags.backend.name,
                                "Names with commas; reference, or else the first, is the oracle;\n"
                                "default: all that run here"),
             "NAMES", kBackendGroup);
    add_output_flags(command, flags.output,
                     {.folder = "Folder for compare.html and compare.json",
                      .json_file = "compare.json",
                      .quiet = "No progress bar, no table"});
}

}  // namespace

void add_compare_command(CLI::App& app, Job& job) {
    const auto flags = std::make_shared<CompareFlags>();
    flags->backend.name.clear();
    CLI::App& command = *app.add_subcommand("compare", "Check that backends agree, on your CT and views");
    add_volume_flags(command, flags->volume);
    describe(
        command.add_option("--views", flags->views, "views.json; views without an image are simulated")->required(),
        "FILE (required)", kInputGroup);
    describe(
        command.add_option("--pose", flags->pose, "world_from_ct to compare around: pose.json or .tfm")->required(),
        "FILE (required)", kStartGroup);
    add_targets_flag(command, flags->targets, kStartGroup, "");
    add_compare_flags(command, *flags);
    finish_command(
        command,
        "  raylign compare -v ct.nii.gz --views views.json --pose pose.json -o compared\n"
        "  raylign compare -v ct.nii.gz --views views.json --pose pose.json --backends reference,cpu,gl -o compared\n"
        "Exit code 1 where anything disagrees.");
    command.callback(
        [flags, &job] { job = [flags](const Invocation& invocation) { return run_compare(*flags, invocation); }; });
}

}  // namespace raylign::detail::apps

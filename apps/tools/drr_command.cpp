#include <algorithm>
#include <iostream>

#include "apps/pictures/picture.h"
#include "apps/shared/commands.h"
#include "apps/shared/detector.h"
#include "apps/shared/help.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/object_volume.h"
#include "apps/shared/options.h"
#include "apps/shared/outputs.h"
#include "apps/shared/parse.h"
#include "core/io/files/output.h"
#include "core/io/images/counts.h"
#include "core/io/images/png.h"
#include "raylign/io/image.h"
#include "raylign/io/pose.h"
#include "raylign/io/views.h"
#include "raylign/simulate.h"

namespace raylign::detail::apps {
namespace {

struct DrrOptions {
    VolumeFlags volume;
    BackendFlags backend;
    ViewFlags views;
    std::filesystem::path pose, output;
    DetectorFlags detector;
    std::uint64_t seed = 1;
    bool png = false;
    bool quiet = false;
};

std::vector<std::filesystem::path> all_inputs(const DrrOptions& options, const ViewsFile& views) {
    std::vector<std::filesystem::path> files = views.files;
    files.insert(files.end(), {options.pose, options.detector.spectrum, options.volume.file, options.volume.labels,
                               options.volume.label_table});
    // Images and masks are not read, and yet they are someone's originals.
    for (const ViewOrigin& origin : views.origins) files.insert(files.end(), {origin.image, origin.mask});
    return files;
}

std::string png_file_name(const std::string& view) { return "drr_" + view + ".png"; }

/// Each view draws noise of its own: seeds far apart, so that view 1 of seed 1 is not view 0 of seed 2.
std::uint64_t seed_of_view(std::uint64_t seed, std::size_t view) { return seed + 0x9E3779B97F4A7C15u * view; }

/// What images are made from, and where they go.
struct DrrJob {
    const DrrOptions& options;
    const std::vector<View>& views;
    const Volume& volume;
    const RigidTransform& world_from_ct;
    OutputFolder& folder;
};

void write_preview(const DrrJob& job, const View& view, const Image& image) {
    if (job.options.png)
        write_png(job.folder.stage(png_file_name(view.name)), grey_picture(image, robust_window(image, view.weights)));
}

std::vector<std::string> image_names(const std::vector<View>& views) {
    std::vector<std::string> names;
    for (const View& view : views) names.push_back(drr_file_name(view.name));
    return names;
}

void warn_of_nothing(const View& view) {
    std::cerr << "raylign drr: warning: view " << view.name
              << " shows nothing of the CT at this pose: its image is empty\n";
}

void write_drrs(const DrrJob& job, Backend& backend) {
    const auto session = backend.prepare({job.volume, job.views, render_settings(job.options.backend), {}});
    const double photons = job.options.detector.noise_photons.value_or(0);
    for (std::size_t i = 0; i < job.views.size(); ++i) {
        stop_if_interrupted();
        Image image = session->render(job.world_from_ct, i);
        if (std::ranges::all_of(image.pixels, [](float v) { return v == 0; })) warn_of_nothing(job.views[i]);
        if (photons > 0) image = with_photon_noise(image, photons, seed_of_view(job.options.seed, i));
        write_image(job.folder.stage(drr_file_name(job.views[i].name)), image);
        write_preview(job, job.views[i], image);
    }
    write_views(job.folder.stage("views.json"), job.views, image_names(job.views));
}

/// As a detector gives them; the previews show what is read of that.
void write_counted(const DrrJob& job) {
    const DrrOptions& options = job.options;
    const XrayModel model = detector_model(options.detector);
    const std::vector<XrayExposure> list = exposures(model, options.detector, job.volume, options.volume, job.views,
                                                     job.world_from_ct, projector_from_name(options.backend.projector));
    for (std::size_t i = 0; i < job.views.size(); ++i) {
        stop_if_interrupted();
        const RawXray counts = detected(model, list[i], seed_of_view(options.seed, i));
        write_counts(job.folder.stage(drr_file_name(job.views[i].name)), counts.image, counts.max_representable);
        if (!options.png) continue;
        View seen = job.views[i];
        read_counts(seen, counts);
        write_preview(job, seen, seen.image);
    }
    write_views(job.folder.stage("views.json"), job.views, image_names(job.views), detector_intensity());
}

int run_drr(const DrrOptions& options) {
    settle_conflicts(options.volume);
    settle_conflicts(options.backend);
    settle_conflicts(options.detector, options.backend);
    (void)render_settings(options.backend);  // checks names before the large file
    const BackendChoice choice = choose_backend(options.backend);
    (void)read_pose(options.pose);  // before the large file
    (void)detector_model(options.detector);
    ViewsFile file = read_views(
        options.views.files,
        {.images = ReadImages::never, .undistorted = parse_truth(options.views.undistorted, "--undistorted")});
    const VolumeFile volume =
        read_object_volume(options.volume, file.views, [&](const VoxelGrid&) { return read_pose(options.pose); });
    const RigidTransform world_from_ct = read_pose(options.pose, volume.files.front());
    stop_if_interrupted();

    std::vector<std::string> outputs{"views.json"};
    for (const View& view : file.views) {
        outputs.push_back(drr_file_name(view.name));
        if (options.png) outputs.push_back(png_file_name(view.name));
    }
    refuse_to_overwrite(all_inputs(options, file), options.output, outputs);
    OutputFolder folder(options.output);
    if (options.detector.is_ideal()) {
        write_drrs({options, file.views, volume.volume, world_from_ct, folder}, *choice.backend);
    } else {
        write_counted({options, file.views, volume.volume, world_from_ct, folder});
    }
    stop_if_interrupted();
    folder.commit();
    if (!options.quiet) {
        for (const std::string& name : outputs) std::cout << (options.output / name).string() << "\n";
    }
    return 0;
}

void add_drr_flags(CLI::App& command, DrrOptions& options) {
    add_detector_flags(command, options.detector, kMethodGroup);
    add_seed_flag(command, options.seed, "Of the noise");
    add_backend_flags(command, options.backend);
    describe(
        command
            .add_option(
                "-o,--output", options.output,
                "Folder for drr_<view>.tif (float32 line integrals, with --xray counts) and\na views.json for register")
            ->required(),
        "DIR (required)", kOutputGroup);
    command.add_flag("--png", options.png, "Also 8-bit previews, bone bright; default off")->group(kOutputGroup);
    command.add_flag("--quiet", options.quiet, "Do not list the files written; default off")->group(kOutputGroup);
}

}  // namespace

void add_drr_command(CLI::App& app, Job& job) {
    const auto options = std::make_shared<DrrOptions>();
    CLI::App& command = *app.add_subcommand("drr", "Simulate X-rays of a CT at a given pose");
    add_volume_flags(command, options->volume);
    add_views_flag(command, options->views, "views.json, whose images are not read");
    describe(
        command
            .add_option("--pose", options->pose, "world_from_ct: pose.json, or an ITK .tfm, which holds ct_from_world")
            ->required(),
        "FILE (required)", kStartGroup);
    add_drr_flags(command, *options);
    finish_command(command,
                   "  raylign drr -v ct.nii.gz --views views.json --pose pose.json -o drrs --png\n"
                   "  raylign drr -v ct.nii.gz --views views.json --pose pose.json --noise 20000 --seed 7 -o xrays\n"
                   "  raylign drr -v ct.nii.gz --views views.json --pose pose.json --xray c-arm -o xrays\n"
                   "  raylign register -v ct.nii.gz --views xrays/views.json --start start.json -o result");
    command.callback([options, &job] { job = [options](const Invocation&) { return run_drr(*options); }; });
}

}  // namespace raylign::detail::apps

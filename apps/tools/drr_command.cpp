#include <algorithm>
#include <iostream>

#include "apps/pictures/picture.h"
#include "apps/shared/commands.h"
#include "apps/shared/help.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/options.h"
#include "apps/shared/outputs.h"
#include "apps/shared/parse.h"
#include "core/io/files/output.h"
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
    double noise_photons = 0;  ///< 0 = no noise
    std::uint64_t seed = 1;
    bool png = false;
    bool quiet = false;
};

std::vector<std::filesystem::path> all_inputs(const DrrOptions& options, const ViewsFile& views) {
    std::vector<std::filesystem::path> files = views.files;
    files.insert(files.end(), {options.pose, options.volume.file, options.volume.labels, options.volume.label_table});
    // Images and masks are not read, and yet they are someone's originals.
    for (const ViewOrigin& origin : views.origins) files.insert(files.end(), {origin.image, origin.mask});
    return files;
}

std::string png_file_name(const std::string& view) { return "drr_" + view + ".png"; }

/// Each view draws noise of its own: seeds far apart, so that view 1 of seed 1 is not view 0 of seed 2.
std::uint64_t seed_of_view(std::uint64_t seed, std::size_t view) { return seed + 0x9E3779B97F4A7C15u * view; }

int run_drr(const DrrOptions& options) {
    settle_conflicts(options.volume);
    settle_conflicts(options.backend);
    check_photons(options.noise_photons);
    const RenderSettings render = render_settings(options.backend);
    const BackendChoice choice = choose_backend(options.backend);
    (void)read_pose(options.pose);  // before the large file
    ViewsFile file = read_views(
        options.views.files,
        {.images = ReadImages::never, .undistorted = parse_truth(options.views.undistorted, "--undistorted")});
    const VolumeFile volume = read_volume(options.volume.file, volume_read_options(options.volume));
    const RigidTransform world_from_ct = read_pose(options.pose, volume.files.front());
    stop_if_interrupted();

    std::vector<std::string> images, outputs{"views.json"};
    for (const View& view : file.views) {
        images.push_back(drr_file_name(view.name));
        outputs.push_back(images.back());
        if (options.png) outputs.push_back(png_file_name(view.name));
    }
    refuse_to_overwrite(all_inputs(options, file), options.output, outputs);
    OutputFolder folder(options.output);
    const auto session = choice.backend->prepare({volume.volume, file.views, render, {}});
    for (std::size_t i = 0; i < file.views.size(); ++i) {
        stop_if_interrupted();
        Image image = session->render(world_from_ct, i);
        if (std::ranges::all_of(image.pixels, [](float v) { return v == 0; })) {
            std::cerr << "raylign drr: warning: view " << file.views[i].name
                      << " shows nothing of the CT at this pose: its image is empty\n";
        }
        if (options.noise_photons > 0) {
            image = with_photon_noise(image, options.noise_photons, seed_of_view(options.seed, i));
        }
        write_image(folder.stage(images[i]), image);
        if (options.png) {
            write_png(folder.stage(png_file_name(file.views[i].name)), grey_picture(image, robust_window(image, {})));
        }
    }
    write_views(folder.stage("views.json"), file.views, images);
    stop_if_interrupted();
    folder.commit();
    if (!options.quiet) {
        for (const std::string& name : outputs) std::cout << (options.output / name).string() << "\n";
    }
    return 0;
}

void add_drr_flags(CLI::App& command, DrrOptions& options) {
    describe(command.add_option("--noise", options.noise_photons,
                                "Photons of an unattenuated pixel, 1 to 1e9; default 0: no noise"),
             "PHOTONS", kMethodGroup);
    add_seed_flag(command, options.seed, "Of the noise");
    add_backend_flags(command, options.backend);
    describe(command
                 .add_option("-o,--output", options.output,
                             "Folder for drr_<view>.tif (float32 line integrals) and a views.json for register")
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
                   "  raylign register -v ct.nii.gz --views xrays/views.json --start start.json -o result");
    command.callback([options, &job] { job = [options](const Invocation&) { return run_drr(*options); }; });
}

}  // namespace raylign::detail::apps

#include <algorithm>
#include <functional>
#include <iostream>

#include "apps/pictures/picture.h"
#include "apps/shared/articulated.h"
#include "apps/shared/commands.h"
#include "apps/shared/detector.h"
#include "apps/shared/help.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/object_volume.h"
#include "apps/shared/options.h"
#include "apps/shared/outputs.h"
#include "apps/shared/parse.h"
#include "core/base/error.h"
#include "core/image/composed.h"
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
    ArticulationFlags articulation;
    std::uint64_t seed = 1;
    bool png = false;
    bool quiet = false;
};

std::vector<std::filesystem::path> all_inputs(const DrrOptions& options, const ViewsFile& views) {
    std::vector<std::filesystem::path> files = views.files;
    files.insert(files.end(), {options.pose, options.detector.spectrum, options.volume.file, options.volume.labels,
                               options.volume.label_table});
    for (const std::string& move : options.articulation.moves) {
        if (const std::size_t equals = move.find('='); equals != std::string::npos) {
            files.emplace_back(move.substr(equals + 1));
        }
    }
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
    const std::vector<PlacedObject>& objects;  ///< without --move the CT alone
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

/// The sum of all objects where they are, per view.
std::vector<Image> rendered(const DrrJob& job, Backend& backend) {
    std::vector<Image> sums;
    for (const PlacedObject& object : job.objects) {
        const auto session = backend.prepare({object.volume, job.views, render_settings(job.options.backend), {}});
        for (std::size_t i = 0; i < job.views.size(); ++i) {
            stop_if_interrupted();
            const Image own = session->render(object.world_from_ct, i);
            if (i == sums.size()) {
                sums.push_back(own);
                continue;
            }
            std::ranges::transform(sums[i].pixels, own.pixels, sums[i].pixels.begin(), std::plus<>());
        }
    }
    return sums;
}

void write_drrs(const DrrJob& job, Backend& backend) {
    std::vector<Image> images = rendered(job, backend);
    const double photons = job.options.detector.noise_photons.value_or(0);
    for (std::size_t i = 0; i < job.views.size(); ++i) {
        Image& image = images[i];
        if (std::ranges::all_of(image.pixels, [](float v) { return v == 0; })) warn_of_nothing(job.views[i]);
        if (photons > 0) image = with_photon_noise(image, photons, seed_of_view(job.options.seed, i));
        write_image(job.folder.stage(drr_file_name(job.views[i].name)), image);
        write_preview(job, job.views[i], image);
    }
    write_views(job.folder.stage("views.json"), job.views, image_names(job.views));
}

/// As a detector gives them; the previews show what is read of that. A model takes one volume: what has moved is
/// resampled into the grid of the CT.
void write_counted(const DrrJob& job) {
    const DrrOptions& options = job.options;
    const XrayModel model = detector_model(options.detector);
    Volume whole = job.objects.front().volume;
    for (std::size_t k = 1; k < job.objects.size(); ++k) {
        add_resampled(whole, job.objects.front().world_from_ct, job.objects[k].volume, job.objects[k].world_from_ct);
    }
    const std::vector<XrayExposure> list =
        exposures(model, options.detector, whole, options.volume, job.views, job.objects.front().world_from_ct,
                  projector_from_name(options.backend.projector));
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

/// The CT, or the objects that it is cut into.
std::vector<PlacedObject> placed_objects(const DrrOptions& options, std::span<const View> views) {
    VolumeFlags flags = options.volume;
    if (!options.articulation.moves.empty()) flags.labels = flags.label_table = "";
    VolumeFile volume = read_object_volume(flags, views, [&](const VoxelGrid&) { return read_pose(options.pose); });
    const RigidTransform world_from_ct = read_pose(options.pose, volume.files.front());
    stop_if_interrupted();
    if (options.articulation.moves.empty()) return {{"", std::move(volume.volume), world_from_ct}};
    return articulated(options.articulation, options.volume, volume.volume, world_from_ct, options.seed);
}

std::string moved_pose_name(const PlacedObject& object) { return "pose_" + object.name + ".json"; }

int run_drr(const DrrOptions& options) {
    settle_conflicts(options.articulation, options.volume);
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
    stop_if_interrupted();
    const std::vector<PlacedObject> objects = placed_objects(options, file.views);
    std::vector<std::string> outputs{"views.json"};
    for (const View& view : file.views) {
        outputs.push_back(drr_file_name(view.name));
        if (options.png) outputs.push_back(png_file_name(view.name));
    }
    for (std::size_t k = 1; k < objects.size(); ++k) outputs.push_back(moved_pose_name(objects[k]));
    refuse_to_overwrite(all_inputs(options, file), options.output, outputs);
    OutputFolder folder(options.output);
    const DrrJob job{options, file.views, objects, folder};
    if (options.detector.is_ideal()) {
        write_drrs(job, *choice.backend);
    } else {
        write_counted(job);
    }
    for (std::size_t k = 1; k < objects.size(); ++k) {
        write_pose(folder.stage(moved_pose_name(objects[k])), objects[k].world_from_ct);
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
    add_seed_flag(command, options.seed, "Of the noise, and of --move");
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
    describe(command.add_option("--move", options->articulation.moves,
                                "Object of --labels by name or number that has moved against the rest: to a pose of\n"
                                "its own, or at random; may be repeated; its pose_NAME.json is left; default none"),
             "NAME[=FILE] ...", kStartGroup);
    describe(command.add_option("--by", options->articulation.by,
                                "Largest random shift and turn of --move, per axis (--seed); default 5,5"),
             "MM,DEG", kStartGroup);
    add_drr_flags(command, *options);
    finish_command(command,
                   "  raylign drr -v ct.nii.gz --views views.json --pose pose.json -o drrs --png\n"
                   "  raylign drr -v ct.nii.gz --views views.json --pose pose.json --noise 20000 --seed 7 -o xrays\n"
                   "  raylign drr -v ct.nii.gz --views views.json --pose pose.json --xray c-arm -o xrays\n"
                   "  raylign drr -v ct.nii.gz --labels seg.nii.gz --move vertebrae_L3 --move vertebrae_L4 --by 5,5\n"
                   "              --views views.json --pose pose.json -o xrays\n"
                   "  raylign register -v ct.nii.gz --views xrays/views.json --start start.json -o result");
    command.callback([options, &job] { job = [options](const Invocation&) { return run_drr(*options); }; });
}

}  // namespace raylign::detail::apps

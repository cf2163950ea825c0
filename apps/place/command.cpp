#include <iostream>

#include "apps/objects/object_options.h"
#include "apps/objects/scene_inputs.h"
#include "apps/shared/append.h"
#include "apps/shared/commands.h"
#include "apps/shared/first_guess.h"
#include "apps/shared/flags.h"
#include "apps/shared/help.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/object_volume.h"
#include "apps/shared/options.h"
#include "apps/shared/outputs.h"
#include "apps/shared/parse.h"
#include "apps/shared/repeated.h"
#include "apps/viewer/viewer_page.h"
#include "core/base/number_text.h"
#include "core/base/text.h"
#include "core/io/files/output.h"
#include "raylign/io/views.h"

namespace raylign::detail::apps {
namespace {

struct PlaceOptions : ObjectOptions {
    std::filesystem::path output;
    GoOn go_on;  ///< register with what was said here of CT, objects and views
    bool quiet = false;
};

/// What the page is made of.
struct PlaceInputs {
    std::vector<SceneInput> objects;
    std::vector<View> views;
    std::vector<ViewOrigin> origins;
    std::vector<std::string> notes;
    std::vector<std::filesystem::path> files;
};

PlaceInputs read_one_object(const PlaceOptions& options) {
    settle_conflicts(options.start);
    ViewsFile views =
        read_views(options.views.files, {.images = ReadImages::if_named,
                                         .auto_mask = options.views.auto_mask,
                                         .undistorted = parse_truth(options.views.undistorted, "--undistorted")});
    VolumeFile volume = read_object_volume(options.volume, views.views, [&](const VoxelGrid& grid) {
        return first_guess(options.start, grid, views).world_from_ct;
    });
    stop_if_interrupted();
    const FirstGuess guess =
        first_guess(options.start, volume.volume.grid, views, {0, 0, "", volume.file_grid, volume.files.front()});
    PlaceInputs inputs;
    for (const auto& files : {views.files, volume.files, guess.files}) append(inputs.files, files);
    for (const auto& notes : {views.notes, volume.notes, guess.notes}) append(inputs.notes, notes);
    inputs.views = std::move(views.views);
    inputs.origins = std::move(views.origins);
    inputs.objects.push_back(
        {options.volume.file.filename().string(), std::move(volume.volume), guess.world_from_ct, Mobility::moves});
    return inputs;
}

PlaceInputs read_place_inputs(const PlaceOptions& options) {
    if (is_scene(options)) {
        SceneInputs scene = read_scene_inputs(options, ReadImages::if_named);
        return {std::move(scene.objects), std::move(scene.views), std::move(scene.origins), std::move(scene.notes),
                std::move(scene.files)};
    }
    PlaceOptions one = options;
    settle_one_object(one);
    return read_one_object(one);
}

void refuse_to_replace_input(const PlaceOptions& options, const std::vector<std::filesystem::path>& files) {
    const std::filesystem::path folder = options.output.parent_path();
    refuse_to_overwrite(files, folder.empty() ? "." : folder, {options.output.filename().string()});
}

ViewerScene scene_of(const PlaceInputs& inputs, const PlaceOptions& options) {
    ViewerScene scene{.title = "Place " + joined(inputs.objects, &SceneInput::name, ", "),
                      .objects = {},
                      .views = inputs.views,
                      .origins = inputs.origins,
                      .frames = {{.xrays = viewer_xrays(inputs.views, XrayDepth::bits_16)}},
                      .go_on = options.go_on,
                      .folder = std::filesystem::current_path(),
                      .notes = inputs.notes};
    for (const SceneInput& object : inputs.objects) {
        scene.objects.push_back({object.name, object.volume, object.mobility == Mobility::moves});
        scene.frames.front().world_from_ct.push_back(object.start_world_from_ct);
        scene.frames.front().status.emplace_back();
    }
    return scene;
}

int run_place(const PlaceOptions& options) {
    settle_conflicts(options.volume);
    refuse_without_viewer();  // before the large file
    const PlaceInputs inputs = read_place_inputs(options);
    stop_if_interrupted();
    refuse_to_replace_input(options, inputs.files);
    const std::string page = viewer_page(scene_of(inputs, options));
    stop_if_interrupted();
    write_text(options.output, page);
    if (!options.quiet) {
        const std::string start = inputs.objects.size() > 1 ? "start.csv" : "start.json";
        std::cout << options.output.string() << " (" << fixed(static_cast<double>(page.size()) / 1e6, 1)
                  << " MB): open it in a browser, place the object, save " << start << ", then\n  "
                  << options.go_on.begin << " --start " << start << " " << options.go_on.end << "\n";
    }
    return 0;
}

/// Those of the CT, the objects and the views: `register` has them, too.
bool serves_register(const CLI::Option& option) {
    return option.get_group() == kInputGroup || option.get_group() == kObjectGroup;
}

}  // namespace

void add_place_command(CLI::App& app, Job& job) {
    const auto options = std::make_shared<PlaceOptions>();
    CLI::App& command = *app.add_subcommand("place", "Make a page to place the CT on the X-rays by hand");
    add_volume_flags(command, options->volume);
    command.get_option("--volume")->required(false)->option_text("FILE");
    add_views_flag(command, options->views, "views.json: images (or none), cameras, masks");
    add_auto_mask_flag(command, options->views);
    add_start_flags(command, options->start);
    add_several_objects_flags(command, options->scene);
    describe(command
                 .add_option("-o,--output", options->output,
                             "The page: one file for any browser with WebGL 2; it loads and sends nothing")
                 ->required(),
             "FILE.html (required)", kOutputGroup);
    command.add_flag("--quiet", options->quiet, "Do not say what to do next; default off")->group(kOutputGroup);
    finish_command(command,
                   "  raylign place -v ct.nii.gz --views views.json -o place.html\n"
                   "  raylign place -v ct.nii.gz --views views.json --start result/pose.json -o correct.html\n"
                   "  raylign register -v ct.nii.gz --views views.json --start start.json -o result\n"
                   "  raylign place -v ct.nii.gz --labels seg.nii.gz --object vertebrae_L3 --object vertebrae_L4\n"
                   "                --views views.json -o lumbar.html");
    command.callback([options, &command, &job] {
        options->go_on = {repeated("register", command, serves_register), "-o result"};
        job = [options](const Invocation&) { return run_place(*options); };
    });
}

}  // namespace raylign::detail::apps

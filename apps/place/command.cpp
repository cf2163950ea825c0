#include <iostream>

#include "apps/shared/commands.h"
#include "apps/shared/first_guess.h"
#include "apps/shared/flags.h"
#include "apps/shared/help.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/object_volume.h"
#include "apps/shared/options.h"
#include "apps/shared/outputs.h"
#include "apps/shared/parse.h"
#include "apps/viewer/viewer_page.h"
#include "core/base/error.h"
#include "core/io/files/output.h"
#include "raylign/io/views.h"

namespace raylign::detail::apps {
namespace {

struct PlaceOptions {
    VolumeFlags volume;
    ViewFlags views;
    StartFlags start;
    std::filesystem::path output;
    std::string command_to_go_on;  ///< register with what was said here of CT and views
    bool quiet = false;
};

/// What was given for the options that `register` has, too: those of the CT and of the views.
std::vector<std::string> repeated(const CLI::App& command) {
    std::vector<std::string> words;
    for (const CLI::Option* option : command.get_options()) {
        const bool is_kept = option->get_group() == kInputGroup || option->get_group() == kObjectGroup;
        if (option->count() == 0 || !is_kept) continue;
        words.push_back(option->get_name());
        if (option->get_expected_max() == 0) continue;  // a flag
        for (const std::string& value : option->results()) words.push_back(value);
    }
    return words;
}

std::string command_to_go_on(const CLI::App& command) {
    std::vector<std::string> words{"raylign", "register"};
    for (std::string& word : repeated(command)) words.push_back(std::move(word));
    words.insert(words.end(), {"--start", "start.json", "-o", "result"});
    return quote_for_shell(words);
}

void refuse_to_replace_input(const PlaceOptions& options, const std::vector<std::filesystem::path>& files) {
    const std::filesystem::path folder = options.output.parent_path();
    refuse_to_overwrite(files, folder.empty() ? "." : folder, {options.output.filename().string()});
}

int run_place(const PlaceOptions& options) {
    settle_conflicts(options.volume);
    settle_conflicts(options.start);
    if (!has_viewer()) {  // before the large file
        throw Error(
            "this build has no page to place objects in: npm, which bundles it, was not there when it was built",
            ErrorKind::unavailable);
    }
    ViewsFile views =
        read_views(options.views.files, {.images = ReadImages::if_named,
                                         .auto_mask = options.views.auto_mask,
                                         .undistorted = parse_truth(options.views.undistorted, "--undistorted")});
    const VolumeFile volume = read_object_volume(options.volume, views.views, [&](const VoxelGrid& grid) {
        return first_guess(options.start, grid, views).world_from_ct;
    });
    stop_if_interrupted();
    const FirstGuess guess =
        first_guess(options.start, volume.volume.grid, views, {0, 0, "", volume.file_grid, volume.files.front()});
    std::vector<std::filesystem::path> files = views.files;
    files.insert(files.end(), volume.files.begin(), volume.files.end());
    files.insert(files.end(), guess.files.begin(), guess.files.end());
    refuse_to_replace_input(options, files);

    std::vector<std::string> notes = views.notes;
    notes.insert(notes.end(), volume.notes.begin(), volume.notes.end());
    notes.insert(notes.end(), guess.notes.begin(), guess.notes.end());
    const std::string page = viewer_page({.name = options.volume.file.filename().string(),
                                          .volume = volume.volume,
                                          .views = views.views,
                                          .start_world_from_ct = guess.world_from_ct,
                                          .command = options.command_to_go_on,
                                          .folder = std::filesystem::current_path(),
                                          .notes = notes});
    stop_if_interrupted();
    write_text(options.output, page);
    if (!options.quiet) {
        std::cout << options.output.string() << " (" << (page.size() + 500000) / 1000000
                  << " MB): open it in a browser, place the object, save start.json, then\n  "
                  << options.command_to_go_on << "\n";
    }
    return 0;
}

}  // namespace

void add_place_command(CLI::App& app, Job& job) {
    const auto options = std::make_shared<PlaceOptions>();
    CLI::App& command = *app.add_subcommand("place", "Make a page to place the CT on the X-rays by hand");
    add_volume_flags(command, options->volume);
    add_views_flag(command, options->views, "views.json: images (or none), cameras, masks");
    add_auto_mask_flag(command, options->views);
    add_start_flags(command, options->start);
    describe(command
                 .add_option("-o,--output", options->output,
                             "The page: one file for any browser with WebGL 2; it loads and sends nothing")
                 ->required(),
             "FILE.html (required)", kOutputGroup);
    command.add_flag("--quiet", options->quiet, "Do not say what to do next; default off")->group(kOutputGroup);
    finish_command(command,
                   "  raylign place -v ct.nii.gz --views views.json -o place.html\n"
                   "  raylign place -v ct.nii.gz --views views.json --start result/pose.json -o correct.html\n"
                   "  raylign register -v ct.nii.gz --views views.json --start start.json -o result");
    command.callback([options, &command, &job] {
        options->command_to_go_on = command_to_go_on(command);
        job = [options](const Invocation&) { return run_place(*options); };
    });
}

}  // namespace raylign::detail::apps

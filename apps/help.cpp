#include "apps/help.h"

#include "core/image/intensity.h"

namespace raylign::apps {
namespace {

/// CLI11's layout with one blank line between groups instead of two.
class Layout final : public CLI::Formatter {
public:
    Layout() { column_width(28); }

    std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
        return CLI::detail::find_and_replace(CLI::Formatter::make_help(app, std::move(name), mode), "\n\n\n", "\n\n");
    }
};

std::string preset_names() {
    std::string names;
    for (const HuPreset& preset : hu_presets()) names += (names.empty() ? "" : ", ") + std::string(preset.name);
    return names;
}

}  // namespace

void set_up_program(CLI::App& app) {
    app.name("raylign");
    app.description("Finds where a CT stands in X-ray images: 2-D/3-D rigid registration.");
    app.formatter(std::make_shared<Layout>());
    app.set_version_flag("--version", "raylign " RAYLIGN_VERSION, "Print the version and exit");
    app.set_help_flag("-h,--help", "Print this help and exit");
    app.get_formatter()->label("SUBCOMMAND", "COMMAND");
    app.get_formatter()->label("Positionals", "What to make");
    app.require_subcommand(1);
    app.footer(
        "From a synthetic CT to a registration (views.json: where the X-ray sources and detectors are):\n"
        "  raylign phantom spine -o spine.mha\n"
        "  raylign drr -v spine.mha --attenuation --views views.json --pose pose.json -o xrays\n"
        "  raylign register -v spine.mha --attenuation --views xrays/views.json -o result\n"
        "`raylign COMMAND --help` lists the options of a command.\n"
        "Exit codes: 0 done, 1 ran but is doubtful, 2 bad input or usage, 3 backend not available, 130 interrupted.");
}

CLI::Option* describe(CLI::Option* option, const std::string& value_word, const char* group) {
    return option->option_text(value_word)->group(group);
}

void add_volume_flags(CLI::App& command, VolumeFlags& flags) {
    describe(
        command
            .add_option("-v,--volume", flags.file, "CT: NIfTI, MHA/MHD, NRRD, multi-page TIFF or a DICOM folder, in HU")
            ->required(),
        "FILE (required)", kInputGroup);
    describe(
        command.add_option("--hu", flags.hu_preset,
                           "HU to 1/mm: " + preset_names() + "; default " + std::string(hu_presets().front().name)),
        "PRESET", kInputGroup);
    describe(command.add_option("--hu-offset", flags.hu_offset,
                                "Added to the stored values to get HU, e.g. -1024; default 0"),
             "HU", kInputGroup);
    command.add_flag("--attenuation", flags.attenuation, "Voxels are attenuation in 1/mm, not HU; default off")
        ->group(kInputGroup);
    describe(
        command.add_option("--series", flags.series, "UID or number of a DICOM folder's series; default the only one"),
        "SERIES", kInputGroup);
    describe(command.add_option("--spacing", flags.spacing,
                                "Voxel spacing in mm, for a multi-page TIFF; default the file's own"),
             "X,Y,Z", kInputGroup);
}

void add_engine_flags(CLI::App& command, EngineFlags& flags) {
    std::string names = "auto";
    for (const std::string& name : backend_names()) names += ", " + name;
    describe(command.add_option("--backend", flags.backend, "One of " + names + "; default auto: the best that runs"),
             "NAME", kBackendGroup);
    describe(command.add_option("--device", flags.device, "GPU of a gl backend; default the first"), "INDEX|NAME",
             kBackendGroup);
    describe(command.add_option("--threads", flags.threads, "Threads of the cpu backend; default 0: all cores"), "N",
             kBackendGroup);
    describe(command.add_option("--storage", flags.storage,
                                "Voxels of the cpu backend: float32, or int16 for half the memory; default float32"),
             "NAME", kBackendGroup);
    describe(command.add_option("--projector", flags.projector, "joseph or trilinear; default joseph"), "NAME",
             kBackendGroup);
    describe(command.add_option("--step", flags.step_mm, "Step of the trilinear projector; default 0: half a voxel"),
             "MM", kBackendGroup);
}

void finish_command(CLI::App& command, const std::string& examples) {
    command.set_help_flag("-h,--help", "Print this help and exit")->group(kOutputGroup);
    command.group("Commands");
    command.footer("Examples:\n" + examples);
}

}  // namespace raylign::apps

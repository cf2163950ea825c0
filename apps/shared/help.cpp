#include "apps/shared/help.h"

#include "raylign/intensity.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
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
    add_object_flags(command, flags);
}

void add_object_flags(CLI::App& command, VolumeFlags& flags) {
    describe(command.add_option("--labels", flags.labels,
                                "Label map or mask of the CT, on any grid: the rest becomes 0; default none"),
             "FILE", kObjectGroup);
    describe(command.add_option("--label", flags.label, "Label to keep, or several; default all but 0"), "N ...",
             kObjectGroup);
    describe(command.add_option("--object", flags.object,
                                "Box to keep, X0,Y0,Z0,X1,Y1,Z1 in CT mm (LPS), or voxels:I0,J0,K0,I1,J1,K1;\n"
                                "default the whole CT"),
             "BOX", kObjectGroup);
    describe(command.add_option("--bone-threshold", flags.bone_threshold,
                                "Voxels count by what they exceed this by (1/mm with --attenuation); default none"),
             "HU", kObjectGroup);
    describe(command.add_option("--clip", flags.clip, "Voxels above are lowered to it: metal; default none"), "HU",
             kObjectGroup);
}

void add_views_option(CLI::App& command, std::vector<std::string>& views, const std::string& what) {
    describe(command
                 .add_option("--views", views,
                             what + "; or geometry files (MayaCam, RTK,\n"
                                    "plastimatch, OpenCV, DICOM), each FILE or FILE=IMAGE")
                 ->required(),
             "FILE ... (required)", kInputGroup);
}

void add_seed_option(CLI::App& command, std::uint64_t& seed, const std::string& what) {
    describe(command.add_option_function<std::string>(
                 "--seed", [&seed](const std::string& text) { seed = parse_seed(text); }, what + "; default 1"),
             "N", kMethodGroup);
}

void add_engine_flags(CLI::App& command, EngineFlags& flags) {
    std::string names = "auto";
    for (const std::string& name : backend_names()) names += ", " + name;
    describe(command.add_option("--backend", flags.backend, "One of " + names + "; default auto: the best that runs"),
             "NAME", kBackendGroup);
    describe(command.add_option("--device", flags.device, "GPU of a gl backend (see raylign info); default the first"),
             "INDEX|NAME", kBackendGroup);
    describe(command.add_option("--threads", flags.threads, "Threads of the cpu backend; default 0: all cores"), "N",
             kBackendGroup);
    describe(command.add_option("--storage", flags.storage,
                                "Voxels of the engine: float32, int16 (half the memory) or auto;\n"
                                "default auto: int16 on gl, float32 on cpu as long as it fits"),
             "NAME", kBackendGroup);
    describe(command.add_option("--interpolation", flags.interpolation,
                                "On gl: hardware (texture filters), or exact; default hardware"),
             "NAME", kBackendGroup);
    command
        .add_flag("--crop", flags.crop, "On gl: keep only the box around the object, for very large CTs; default off")
        ->group(kBackendGroup);
    describe(command.add_option("--projector", flags.projector, "joseph or trilinear; default joseph"), "NAME",
             kBackendGroup);
    describe(command.add_option("--step", flags.step_mm, "Step of the trilinear projector; default 0: half a voxel"),
             "MM", kBackendGroup);
    describe(command.add_option("--slices", flags.slices,
                                "On gl-2006: object-aligned or view-aligned; default as the projector says"),
             "NAME", kBackendGroup);
    describe(
        command.add_option("--reduction", flags.reduction, "On gl-2006: passes, mipmap or mipmap-half; default passes"),
        "NAME", kBackendGroup);
    describe(command.add_option("--readback", flags.readback, "On gl-2006: sums or image; default sums"), "NAME",
             kBackendGroup);
}

void finish_command(CLI::App& command, const std::string& examples) {
    command.set_help_flag("-h,--help", "Print this help and exit")->group(kOutputGroup);
    command.group("Commands");
    command.footer("Examples:\n" + examples);
}

}  // namespace raylign::detail::apps

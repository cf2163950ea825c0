#include "apps/shared/flags.h"

#include "apps/shared/help.h"
#include "apps/shared/lines.h"
#include "apps/shared/parse.h"
#include "core/base/text.h"
#include "core/registration/policy.h"
#include "raylign/backends.h"
#include "raylign/intensity.h"

namespace raylign::detail::apps {
namespace {

std::string hu_preset_names() {
    std::vector<std::string_view> names;
    for (const HuPreset& preset : hu_presets()) names.push_back(preset.name);
    return joined(names);
}

void add_model_flags(CLI::App& command, VolumeFlags& flags) {
    describe(command.add_option("--material", flags.materials,
                                "What a model is made of: cobalt-chrome, titanium, steel, polyethylene, bone, HU=N or\n"
                                "MU=N (1/mm); of several objects NAME=MATERIAL; default none: must be given"),
             "MATERIAL ...", kObjectGroup);
    describe(command.add_option("--mesh-spacing", flags.mesh_spacing_mm,
                                "Voxels that a model is cut into; default 0: two thirds of a pixel of the views there"),
             "MM", kObjectGroup);
    describe(
        command.add_option("--mesh-drr", flags.mesh_drr,
                           "What a model's DRRs are made from: its triangles (exact) or its voxels; default triangles"),
        "triangles|voxels", kObjectGroup);
    describe(command.add_option("--mesh-unit", flags.mesh_unit, "Unit of a model: mm, cm, m or in; default mm"), "UNIT",
             kObjectGroup);
}

/// Part of the volume's.
void add_object_flags(CLI::App& command, VolumeFlags& flags) {
    describe(command.add_option("--labels", flags.labels,
                                "Label map or mask of the CT, on any grid: the rest becomes 0; default none"),
             "FILE", kObjectGroup);
    describe(command.add_option("--label", flags.label,
                                "Label to keep, or several, by number or name (vertebrae_L3); default all but 0"),
             "N|NAME ...", kObjectGroup);
    describe(command.add_option("--labels-table", flags.label_table,
                                "Names of the labels: CSV number,name, or 3D Slicer's or ITK-SNAP's;\n"
                                "default the map's own, or TotalSegmentator's"),
             "FILE", kObjectGroup);
    describe(command.add_option("--object", flags.object,
                                "Box to keep, X0,Y0,Z0,X1,Y1,Z1 in CT mm (LPS), or voxels:I0,J0,K0,I1,J1,K1;\n"
                                "default the whole CT"),
             "BOX", kObjectGroup);
    describe(command.add_option("--bone-threshold", flags.bone_threshold,
                                "Voxels count by what they exceed this by (1/mm with --attenuation); default none"),
             "HU", kObjectGroup);
    describe(command.add_option("--clip", flags.clip, "Voxels above are lowered to it: metal; default none"), "HU",
             kObjectGroup);
    add_model_flags(command, flags);
}

}  // namespace

void add_volume_flags(CLI::App& command, VolumeFlags& flags) {
    describe(command
                 .add_option("-v,--volume", flags.file,
                             "CT: NIfTI, MHA/MHD, NRRD, multi-page TIFF or a DICOM folder, in HU;\n"
                             "or a model: STL, OBJ, PLY, or JSON with several parts; default none")
                 ->required(),
             "FILE (required)", kInputGroup);
    describe(
        command.add_option("--hu", flags.hu_preset,
                           "HU to 1/mm: " + hu_preset_names() + "; default " + std::string(hu_presets().front().name)),
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

void add_start_flags(CLI::App& command, StartFlags& flags) {
    describe(
        command.add_option("--start", flags.pose,
                           "world_from_ct to start from: pose.json, an ITK .tfm (ct_from_world), .dcm, .jts, .tra,\n"
                           "or \"dicom\";\n"
                           "default: CT centre where central rays meet, patient axes as world axes"),
        "FILE", kStartGroup);
    describe(command.add_option("--landmarks3d", flags.landmarks3d,
                                "Points in the CT to start from: Markups JSON, .fcsv, CSV; default none"),
             "FILE", kStartGroup);
    describe(command.add_option("--landmarks", flags.landmarks,
                                "The same points in a view, CSV name,x,y or JSON [px]; may be repeated; default none"),
             "VIEW=FILE ...", kStartGroup);
}

void add_targets_flag(CLI::App& command, std::filesystem::path& targets, const char* group, const std::string& use) {
    describe(command.add_option("--targets", targets,
                                "Points in the CT (JSON, CSV, .fcsv)" + use + "; default: over the bone"),
             "FILE", group);
}

void add_truth_flags(CLI::App& command, TruthFlags& flags) {
    add_targets_flag(command, flags.targets, kStartGroup, ": rotation centre, TRE");
    describe(command.add_option("--truth", flags.truth, "True pose, to report the error; default none"), "FILE",
             kStartGroup);
}

void add_undistorted_flag(CLI::App& command, std::string& undistorted, const char* group) {
    describe(
        command.add_option("--undistorted", undistorted,
                           "Whether the images come undistorted, so that the file's distortion is not to be undone:\n"
                           "true or false; default false (MayaCam: must be said)"),
        "BOOL", group);
}

void add_views_flag(CLI::App& command, ViewFlags& flags, const std::string& what) {
    describe(command
                 .add_option(
                     "--views", flags.files,
                     what + "; or geometry files (MayaCam, RTK,\n"
                            "plastimatch, OpenCV, DICOM, JointTrack), each FILE or FILE=IMAGE; Autoscoper's trial.cfg")
                 ->required(),
             "FILE ... (required)", kInputGroup);
    add_undistorted_flag(command, flags.undistorted, kInputGroup);
}

void add_auto_mask_flag(CLI::App& command, ViewFlags& flags) {
    command
        .add_flag("--auto-mask", flags.auto_mask,
                  "Leave out collimator, shutter, letters, saturated and zero pixels; default off")
        ->group(kInputGroup);
}

void add_saturation_flag(CLI::App& command, ViewFlags& flags) {
    describe(
        command.add_option("--saturation", flags.saturation,
                           "Line integral above which the detector shows nothing more (metal): a number, none, or\n"
                           "auto, from each view's flat densest region, for models of metal; default auto"),
        "auto|none|L", kInputGroup);
}

void add_method_flags(CLI::App& command, MethodFlags& flags) {
    describe(command.add_option("--method", flags.name, "auto, gauss-newton, steepest-descent or bobyqa; default auto"),
             "NAME", kMethodGroup);
    describe(command.add_option("--metric", flags.metric, "gc (gradient correlation) or ncc; default gc"), "NAME",
             kMethodGroup);
    describe(command.add_option("--content", flags.content,
                                "What the CT explains of the X-ray: whole, part (one bone among other tissue)\n"
                                "or auto; default auto: part where whole correlates weakly"),
             "NAME", kMethodGroup);
    command
        .add_flag("--no-robust", flags.no_robust,
                  "Do not weigh down what the DRR cannot explain (metal, other tissue); default off")
        ->group(kMethodGroup);
    describe(command.add_option("--levels", flags.levels,
                                "Resolutions, coarse to fine, 1 to 8; default 0: down to about 32 px"),
             "N", kMethodGroup);
    describe(command.add_option("--max-iterations", flags.max_iterations, "Most steps per level; default 100"), "N",
             kMethodGroup);
    add_seed_flag(command, flags.seed, "For methods that draw random numbers");
}

void add_search_flags(CLI::App& command, SearchFlags& flags) {
    describe(command.add_option("--search", flags.mode,
                                "Other starts: none, near (around the start), global (anywhere in the field of\n"
                                "view) or auto; default auto: near where the content is part, else none"),
             "NAME", kSearchGroup);
    describe(command.add_option("--search-range", flags.range_mm,
                                format("near: how far the object may be off, up to 500; default %g", kNearRange_mm)),
             "MM", kSearchGroup);
    describe(command.add_option("--search-turn", flags.turn_deg,
                                format("Largest turn from the start, up to 180; default %g near, %g global",
                                       kNearTurn_deg, kGlobalTurn_deg)),
             "DEG", kSearchGroup);
    describe(
        command.add_option("--search-starts", flags.starts,
                           format("Poses tried for a whole; default %d near, %d global;\na part is sought exhaustively",
                                  kNearStarts, kGlobalStarts)),
        "N", kSearchGroup);
    describe(command.add_option("--time-limit", flags.time_limit_s,
                                "Give the best pose found in this time, as doubtful; default none"),
             "S", kSearchGroup);
}

void add_backend_flags(CLI::App& command, BackendFlags& flags) {
    describe(command.add_option("--backend", flags.name,
                                "One of auto, " + joined(backend_names()) + "; default auto: the best that runs"),
             "NAME", kBackendGroup);
    describe(command.add_option("--device", flags.device, "GPU of a gl backend (see raylign info); default the first"),
             "INDEX|NAME", kBackendGroup);
    describe(
        command.add_option("--threads", flags.threads,
                           "Threads of the cpu backend, and of the host beside a gl backend; default 0: all cores"),
        "N", kBackendGroup);
    describe(command.add_option("--storage", flags.storage,
                                "Voxels of the backend: float32, int16 (half the memory) or auto;\n"
                                "default auto: int16, but float32 on cpu with SSE2 as long as it fits"),
             "NAME", kBackendGroup);
    describe(command.add_option("--interpolation", flags.interpolation,
                                "On gl: hardware (texture filters), or exact; default hardware"),
             "NAME", kBackendGroup);
    describe(command.add_option("--solver", flags.solver,
                                "On gl: who solves for steps of gauss-newton, host or device; default host"),
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

void add_seed_flag(CLI::App& command, std::uint64_t& seed, const std::string& what, const char* group) {
    describe(command.add_option_function<std::string>(
                 "--seed", [&seed](const std::string& text) { seed = parse_seed(text); }, what + "; default 1"),
             "N", group);
}

void add_output_flags(CLI::App& command, OutputFlags& flags, const OutputTexts& texts) {
    describe(command.add_option("-o,--output", flags.folder, texts.folder)->required(), "DIR (required)", kOutputGroup);
    command.add_flag("--json", flags.json, "Print " + texts.json_file + " and nothing else; default off")
        ->group(kOutputGroup);
    command.add_flag("--quiet", flags.quiet, texts.quiet + "; default off")->group(kOutputGroup);
}

}  // namespace raylign::detail::apps

#include "apps/shared/options.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "apps/shared/object_volume.h"
#include "apps/shared/parse.h"
#include "core/base/error.h"
#include "core/base/names.h"
#include "core/base/number_text.h"
#include "core/base/text.h"
#include "core/io/files/text.h"
#include "raylign/intensity.h"

namespace raylign::detail::apps {
namespace {

/// "X0,Y0,Z0,X1,Y1,Z1" in mm of ct, or "voxels:" and six indices, the second three not included.
void parse_object(const std::string& text, ObjectRegion& object) {
    constexpr std::string_view kVoxels = "voxels:";
    const bool is_voxels = text.starts_with(kVoxels);
    const std::string_view numbers_text = std::string_view(text).substr(is_voxels ? kVoxels.size() : 0);
    const std::vector<double> n = parse_numbers(numbers_text, 6, "--object");
    const Eigen::Vector3d low(n[0], n[1], n[2]), high(n[3], n[4], n[5]);
    if (!(low.array() < high.array()).all()) {
        throw bad_value("--object", text, "X0,Y0,Z0,X1,Y1,Z1 with each first number below its second");
    }
    if (!is_voxels) {
        object.box_mm = CtBox{low, high};
        return;
    }
    if (low != low.array().round().matrix() || high != high.array().round().matrix() ||
        !(high.cwiseAbs().maxCoeff() < 1e6) || !(low.minCoeff() >= 0)) {
        throw bad_value("--object", text, "whole numbers from 0 after \"voxels:\"");
    }
    object.box_voxels = VoxelBox{low.cast<int>(), high.cast<int>()};
}

/// "29"; empty for a name, and an error for a number that is no label.
std::optional<int> label_number(const std::string& text) {
    const std::optional<double> number = number_from(text);
    if (!number) return std::nullopt;
    if (*number == std::round(*number) && std::abs(*number) < 2147483648.0) return static_cast<int>(*number);
    throw bad_value("--label", text, "a whole number of up to 32 bits, or a name");
}

ObjectRegion object_region(const VolumeFlags& flags) {
    if (flags.labels.empty() && !flags.label.empty()) {
        throw Error("--label " + flags.label.front() + " needs the map: give --labels FILE");
    }
    if (flags.labels.empty() && !flags.label_table.empty()) {
        throw Error("--labels-table " + flags.label_table.string() + " needs the map: give --labels FILE");
    }
    ObjectRegion object;
    object.label_map = flags.labels;
    object.label_table = flags.label_table;
    for (const std::string& label : flags.label) {
        if (const std::optional<int> number = label_number(label)) {
            object.labels.push_back(*number);
        } else {
            object.label_names.push_back(label);
        }
    }
    object.bone_threshold_hu = flags.bone_threshold;
    object.clip_hu = flags.clip;
    if (flags.clip && flags.bone_threshold && !(*flags.clip > *flags.bone_threshold)) {
        throw bad_value("--clip", number_text(*flags.clip), "above --bone-threshold");
    }
    if (!flags.object.empty()) parse_object(flags.object, object);
    return object;
}

void check_word(std::string_view option, const std::string& word, std::initializer_list<std::string_view> known) {
    if (word.empty() || std::ranges::find(known, word) != known.end()) return;
    throw bad_value(option, word, joined(known, " or "));
}

/// Options of the OpenGL backends.
void settle_gl(const BackendFlags& flags) {
    check_word("--storage", flags.storage, {"auto", "float32", "int16"});
    check_word("--interpolation", flags.interpolation, {"hardware", "exact"});
    check_word("--solver", flags.solver, {"host", "device"});
    check_word("--slices", flags.slices, {"view-aligned", "object-aligned"});
    check_word("--reduction", flags.reduction, {"passes", "mipmap", "mipmap-half"});
    check_word("--readback", flags.readback, {"sums", "image"});
    const bool on_host = flags.name == "cpu" || flags.name == "reference";
    const Error no_textures("--interpolation hardware and --crop are for GPUs: they have no meaning for --backend " +
                            flags.name);
    if (on_host && (flags.crop || flags.interpolation == "hardware")) throw no_textures;
    if (flags.name == "reference" && flags.storage == "int16") {
        throw bad_value("--storage", flags.storage, "float32 or left out", "--backend reference");
    }
    if (flags.solver == "device" && (on_host || flags.name == "gl-2006")) {
        throw bad_value("--solver", flags.solver, "host or left out, or used with --backend gl");
    }
    if (flags.name == "gl-2006") return;
    for (const auto& [option, word] :
         {std::pair("--slices", flags.slices), {"--reduction", flags.reduction}, {"--readback", flags.readback}}) {
        if (!word.empty()) throw bad_value(option, word, "left out, or used with --backend gl-2006");
    }
}

}  // namespace

void settle_conflicts(const VolumeFlags& flags) {
    if (flags.attenuation && (!flags.hu_preset.empty() || flags.hu_offset != 0)) {
        throw Error("--attenuation contradicts --hu and --hu-offset: voxels are either HU or 1/mm");
    }
    const bool is_for_model =
        !flags.materials.empty() || flags.mesh_spacing_mm != 0 || !flags.mesh_unit.empty() || !flags.mesh_drr.empty();
    if (is_for_model && !flags.file.empty() && !is_model(flags.file)) {
        throw Error(flags.file.string() +
                    " is no model (STL, OBJ, PLY): --material, --mesh-spacing, --mesh-drr and --mesh-unit "
                    "must be left out");
    }
}

void settle_conflicts(const BackendFlags& flags) {
    if (flags.step_mm != 0 && flags.projector == "joseph") {
        throw Error(
            "--step has no meaning for --projector joseph, which steps by planes of voxels: use --projector trilinear");
    }
    if (flags.name == "reference" && flags.threads > 1) {
        throw bad_value("--threads", std::to_string(flags.threads), "1 or left out", "--backend reference");
    }
    settle_gl(flags);
    if (!flags.device.empty() && (flags.name == "cpu" || flags.name == "reference")) {
        throw bad_value("--device", flags.device, "left out: it chooses a GPU", "--backend " + flags.name);
    }
}

void settle_conflicts(const SearchFlags& search, const MethodFlags& method) {
    const bool none = search.mode == "none";
    if (none && (search.range_mm != 0 || search.turn_deg != 0 || search.starts != 0)) {
        throw Error("--search none contradicts --search-range, --search-turn and --search-starts");
    }
    if (search.mode == "global" && search.range_mm != 0) {
        throw Error("--search-range has no meaning for --search global, which searches the whole field of view");
    }
    if (method.name != "auto" && method.name != "gauss-newton" && search.mode != "auto" && !none) {
        throw Error("--search " + search.mode + " refines its starts by gauss-newton: leave --method " + method.name +
                    " out");
    }
}

void settle_conflicts(const StartFlags& flags) {
    if (flags.landmarks.empty() != flags.landmarks3d.empty()) {
        throw Error(flags.landmarks.empty() ? "--landmarks3d needs the points in the images: give --landmarks VIEW=FILE"
                                            : "--landmarks needs the points in the CT: give --landmarks3d FILE");
    }
    if (!flags.landmarks.empty() && !flags.pose.empty()) {
        throw Error("--start contradicts --landmarks: must be one of them");
    }
    for (const std::string& argument : flags.landmarks) (void)split_named(argument, "--landmarks", "VIEW=FILE");
}

VolumeReadOptions volume_read_options(const VolumeFlags& flags) {
    VolumeReadOptions options;
    options.hu_preset = flags.hu_preset;
    options.is_attenuation = flags.attenuation;
    options.hu_offset = flags.hu_offset;
    options.series = flags.series;
    if (!flags.hu_preset.empty()) (void)hu_preset(flags.hu_preset);  // an unknown name fails before anything is read
    options.material = material_of(flags.materials, "");
    options.mesh_spacing_mm = given(flags.mesh_spacing_mm);
    options.mesh_unit = flags.mesh_unit;
    if (!flags.mesh_drr.empty() && flags.mesh_drr != "triangles" && flags.mesh_drr != "voxels") {
        throw bad_value("--mesh-drr", flags.mesh_drr, "triangles or voxels");
    }
    options.keeps_surface = flags.mesh_drr != "voxels";
    if (!flags.spacing.empty()) options.spacing_mm = parse_triple(flags.spacing, "--spacing");
    options.object = object_region(flags);
    return options;
}

RenderSettings render_settings(const BackendFlags& flags) {
    return {.projector = projector_from_name(flags.projector), .step_mm = given(flags.step_mm)};
}

RegistrationOptions registration_options(const MethodFlags& method, const SearchFlags& search,
                                         const BackendFlags& backend) {
    RegistrationOptions registration;
    registration.method = method_from_name(method.name);
    registration.similarity.metric = metric_from_name(method.metric);
    registration.render = render_settings(backend);
    registration.levels = given(method.levels);
    registration.max_iterations_per_level = method.max_iterations;
    registration.content = content_from_name(method.content);
    registration.search = {.mode = search_from_name(search.mode),
                           .range_mm = given(search.range_mm),
                           .range_deg = given(search.turn_deg),
                           .starts = given(search.starts),
                           .seed = method.seed};
    registration.robust = !method.no_robust;
    registration.time_limit_s = given(search.time_limit_s);
    return registration;
}

BackendFlags with_backend(BackendFlags flags, const std::string& name) {
    const bool mipmap = name == "gl-2006-mipmap";
    flags.name = mipmap ? "gl-2006" : name;
    if (mipmap) flags.reduction = "mipmap";
    return flags;
}

namespace {

using Slices = Gl2006Options::Slices;
using Reduction = Gl2006Options::Reduction;
using Readback = Gl2006Options::Readback;
constexpr Names<Slices, 2> kSlices{
    {{Slices::view_aligned, "view-aligned"}, {Slices::object_aligned, "object-aligned"}}};
constexpr Names<Reduction, 3> kReductions{
    {{Reduction::passes, "passes"}, {Reduction::mipmap, "mipmap"}, {Reduction::mipmap_half, "mipmap-half"}}};
constexpr Names<Readback, 2> kReadbacks{{{Readback::sums, "sums"}, {Readback::image, "image"}}};

}  // namespace

BackendOptions backend_options(const BackendFlags& flags) {
    BackendOptions options;
    options.cpu.threads = options.gl.threads = given(flags.threads);
    options.gl.device = flags.device;
    options.gl.crop = flags.crop;
    if (!flags.solver.empty()) options.gl.solver = solver_from_name(flags.solver);
    if (!flags.interpolation.empty()) options.gl.interpolation = interpolation_from_name(flags.interpolation);
    if (!flags.storage.empty() && flags.storage != "auto") {
        const Storage storage = storage_from_name(flags.storage);
        options.cpu.storage = storage;
        options.gl.storage = storage;
    }
    static_cast<GlOptions&>(options.gl_2006) = options.gl;
    if (!flags.slices.empty()) options.gl_2006.slices = value_in(kSlices, "--slices", flags.slices);
    if (!flags.reduction.empty()) options.gl_2006.reduction = value_in(kReductions, "--reduction", flags.reduction);
    if (!flags.readback.empty()) options.gl_2006.readback = value_in(kReadbacks, "--readback", flags.readback);
    return options;
}

BackendChoice choose_backend(const BackendFlags& flags) {
    BackendChoice choice = create_backend(flags.name, backend_options(flags));
    const std::string name = choice.backend->info().name;
    if (!flags.device.empty() && name == "cpu") {
        throw Error("--device " + flags.device + ": no GPU backend can run here, --backend auto came down to " + name,
                    ErrorKind::unavailable);
    }
    return choice;
}

}  // namespace raylign::detail::apps

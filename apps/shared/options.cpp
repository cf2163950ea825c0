#include "apps/shared/options.h"

#include <algorithm>
#include <charconv>
#include <utility>

#include "core/base/error.h"
#include "core/base/names.h"
#include "raylign/intensity.h"

namespace raylign::detail::apps {
namespace {

/// On the command line 0 stands for the default.
template <class Number>
std::optional<Number> given(Number value) {
    return value == 0 ? std::nullopt : std::optional<Number>(value);
}

void settle_volume(const VolumeFlags& flags) {
    if (flags.attenuation && (!flags.hu_preset.empty() || flags.hu_offset != 0)) {
        throw Error("--attenuation contradicts --hu and --hu-offset: voxels are either HU or 1/mm");
    }
}

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

ObjectRegion object_region(const VolumeFlags& flags) {
    if (flags.labels.empty() && !flags.label.empty()) {
        throw Error("--label " + std::to_string(flags.label.front()) + " needs the map: give --labels FILE");
    }
    ObjectRegion object;
    object.label_map = flags.labels;
    object.labels.assign(flags.label.begin(), flags.label.end());
    object.bone_threshold_hu = flags.bone_threshold;
    object.clip_hu = flags.clip;
    if (flags.clip && flags.bone_threshold && !(*flags.clip > *flags.bone_threshold)) {
        throw bad_value("--clip", std::to_string(*flags.clip), "above --bone-threshold");
    }
    if (!flags.object.empty()) parse_object(flags.object, object);
    return object;
}

void check_word(std::string_view option, const std::string& word, std::initializer_list<std::string_view> known) {
    if (word.empty() || std::ranges::find(known, word) != known.end()) return;
    std::string allowed;
    for (const std::string_view name : known) allowed += (allowed.empty() ? "" : " or ") + std::string(name);
    throw bad_value(option, word, allowed);
}

/// Options of the OpenGL engines.
void settle_gl(const EngineFlags& flags) {
    check_word("--storage", flags.storage, {"auto", "float32", "int16"});
    check_word("--interpolation", flags.interpolation, {"hardware", "exact"});
    check_word("--slices", flags.slices, {"view-aligned", "object-aligned"});
    check_word("--reduction", flags.reduction, {"passes", "mipmap", "mipmap-half"});
    check_word("--readback", flags.readback, {"sums", "image"});
    const bool on_host = flags.backend == "cpu" || flags.backend == "reference";
    const Error no_textures("--interpolation hardware and --crop are for GPUs: they have no meaning for --backend " +
                            flags.backend);
    if (on_host && (flags.crop || flags.interpolation == "hardware")) throw no_textures;
    if (flags.backend == "reference" && flags.storage == "int16") {
        throw bad_value("--storage", flags.storage, "float32 or left out", "--backend reference");
    }
    if (flags.backend == "gl-2006") return;
    for (const auto& [option, word] :
         {std::pair("--slices", flags.slices), {"--reduction", flags.reduction}, {"--readback", flags.readback}}) {
        if (!word.empty()) throw bad_value(option, word, "left out, or used with --backend gl-2006");
    }
}

void settle_engine(const EngineFlags& flags) {
    if (flags.step_mm != 0 && flags.projector == "joseph") {
        throw Error(
            "--step has no meaning for --projector joseph, which steps by planes of voxels: use --projector trilinear");
    }
    if (flags.backend == "reference" && flags.threads > 1) {
        throw bad_value("--threads", std::to_string(flags.threads), "1 or left out", "--backend reference");
    }
    settle_gl(flags);
    if (!flags.device.empty() && (flags.backend == "cpu" || flags.backend == "reference")) {
        throw bad_value("--device", flags.device, "left out: it chooses a GPU", "--backend " + flags.backend);
    }
}

}  // namespace

namespace {

/// Search flags that the chosen mode would ignore.
void settle_search(const RegisterOptions& options) {
    const bool none = options.search == "none";
    if (none && (options.search_range_mm != 0 || options.search_turn_deg != 0 || options.search_starts != 0)) {
        throw Error("--search none contradicts --search-range, --search-turn and --search-starts");
    }
    if (options.search == "global" && options.search_range_mm != 0) {
        throw Error("--search-range has no meaning for --search global, which searches the whole field of view");
    }
    if (options.method != "auto" && options.method != "gauss-newton" && options.search != "auto" && !none) {
        throw Error("--search " + options.search + " refines its starts by gauss-newton: leave --method " +
                    options.method + " out");
    }
}

}  // namespace

void settle_conflicts(const RegisterOptions& options) {
    settle_volume(options.volume);
    settle_engine(options.engine);
    settle_search(options);
}

void settle_conflicts(const DrrOptions& options) {
    settle_volume(options.volume);
    settle_engine(options.engine);
}

VolumeReadOptions volume_read_options(const VolumeFlags& flags) {
    VolumeReadOptions options;
    options.hu_preset = flags.hu_preset;
    options.is_attenuation = flags.attenuation;
    options.hu_offset = flags.hu_offset;
    options.series = flags.series;
    if (!flags.hu_preset.empty()) (void)hu_preset(flags.hu_preset);  // an unknown name fails before anything is read
    if (!flags.spacing.empty()) options.spacing_mm = parse_triple(flags.spacing, "--spacing");
    options.object = object_region(flags);
    return options;
}

RenderSettings render_settings(const EngineFlags& flags) {
    return {.projector = projector_from_name(flags.projector), .step_mm = given(flags.step_mm)};
}

RegistrationOptions registration_options(const RegisterOptions& options) {
    RegistrationOptions registration;
    registration.method = method_from_name(options.method);
    registration.similarity.metric = metric_from_name(options.metric);
    registration.render = render_settings(options.engine);
    registration.levels = given(options.levels);
    registration.max_iterations_per_level = options.max_iterations;
    registration.content = content_from_name(options.content);
    registration.search = {.mode = search_from_name(options.search),
                           .range_mm = given(options.search_range_mm),
                           .range_deg = given(options.search_turn_deg),
                           .starts = given(options.search_starts),
                           .seed = options.seed};
    registration.robust = !options.no_robust;
    registration.time_limit_s = given(options.time_limit_s);
    return registration;
}

EngineFlags with_backend(EngineFlags flags, const std::string& name) {
    const bool mipmap = name == "gl-2006-mipmap";
    flags.backend = mipmap ? "gl-2006" : name;
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

BackendOptions backend_options(const EngineFlags& flags) {
    BackendOptions options;
    options.cpu.threads = given(flags.threads);
    options.gl.device = flags.device;
    options.gl.crop = flags.crop;
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

}  // namespace

BackendChoice choose_backend(const EngineFlags& flags) {
    BackendChoice choice = create_backend(flags.backend, backend_options(flags));
    const std::string name = choice.backend->info().name;
    if (!flags.device.empty() && name == "cpu") {
        throw Error("--device " + flags.device + ": no GPU backend can run here, --backend auto came down to " + name,
                    ErrorKind::unavailable);
    }
    return choice;
}

namespace {

/// The numbers between commas; empty where the text is anything else.
std::vector<double> numbers_in(std::string_view text) {
    std::vector<double> numbers;
    const char* at = text.data();
    const char* const end = text.data() + text.size();
    while (true) {
        double number = 0;
        const auto [next, status] = std::from_chars(at, end, number);
        if (status != std::errc{}) return {};
        numbers.push_back(number);
        if (next == end) return numbers;
        if (*next != ',') return {};
        at = next + 1;
    }
}

}  // namespace

std::vector<double> parse_numbers(std::string_view text, std::size_t count, std::string_view option) {
    std::vector<double> numbers = numbers_in(text);
    if (numbers.size() != count) {
        throw bad_value(option, text, std::to_string(count) + " numbers with commas between them");
    }
    return numbers;
}

Eigen::Vector3d parse_triple(std::string_view text, std::string_view option) {
    const std::vector<double> numbers = numbers_in(text);
    if (numbers.size() == 1) return Eigen::Vector3d::Constant(numbers[0]);
    if (numbers.size() != 3) throw bad_value(option, text, "three numbers X,Y,Z, or one for all three");
    return {numbers[0], numbers[1], numbers[2]};
}

std::uint64_t parse_seed(std::string_view text) {
    std::uint64_t seed = 0;
    const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), seed);
    if (status != std::errc{} || end != text.data() + text.size()) {
        throw bad_value("--seed", text, "a whole number in [0, 2^64)");
    }
    return seed;
}

std::string quote_for_shell(const std::vector<std::string>& arguments) {
    constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_./,:=+@%";
    std::string line;
    for (const std::string& argument : arguments) {
        if (!line.empty()) line += ' ';
        if (!argument.empty() && argument.find_first_not_of(kPlain) == std::string::npos) {
            line += argument;
            continue;
        }
        line += '\'';
        for (const char c : argument) line += c == '\'' ? std::string("'\\''") : std::string(1, c);
        line += '\'';
    }
    return line;
}

void refuse_to_overwrite(const std::vector<std::filesystem::path>& inputs, const std::filesystem::path& folder,
                         const std::vector<std::string>& names) {
    for (const std::string& name : names) {
        const std::filesystem::path output = folder / name;
        for (const std::filesystem::path& input : inputs) {
            std::error_code missing;  // a file that is not there cannot be overwritten
            if (std::filesystem::equivalent(input, output, missing)) {
                throw Error("-o " + folder.string() + ": would overwrite the input " + input.string() +
                            "; give another folder");
            }
        }
    }
}

}  // namespace raylign::detail::apps

#include "apps/options.h"

#include <charconv>

#include "core/error.h"
#include "core/image/intensity.h"

namespace raylign::apps {
namespace {

void settle_volume(const VolumeFlags& flags) {
    if (flags.attenuation && (!flags.hu_preset.empty() || flags.hu_offset != 0)) {
        throw Error("--attenuation contradicts --hu and --hu-offset: voxels are either HU or 1/mm");
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
    if (flags.storage != "float32" && flags.storage != "int16") {
        throw bad_value("--storage", flags.storage, "float32 or int16");
    }
    if (!flags.device.empty() && (flags.backend == "cpu" || flags.backend == "reference")) {
        throw bad_value("--device", flags.device, "left out: it chooses a GPU", "--backend " + flags.backend);
    }
}

}  // namespace

void settle_conflicts(const RegisterOptions& options) {
    settle_volume(options.volume);
    settle_engine(options.engine);
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
    return options;
}

RenderSettings render_settings(const EngineFlags& flags) {
    return {.projector = projector_from_name(flags.projector), .step_mm = flags.step_mm};
}

RegistrationOptions registration_options(const RegisterOptions& options) {
    RegistrationOptions registration;
    registration.method = method_from_name(options.method);
    registration.similarity.metric = metric_from_name(options.metric);
    registration.render = render_settings(options.engine);
    registration.levels = options.levels;
    registration.max_iterations_per_level = options.max_iterations;
    return registration;
}

BackendChoice choose_backend(const EngineFlags& flags) {
    BackendChoice choice = create_backend(
        flags.backend,
        {.threads = flags.threads, .instruction_set = {}, .device = flags.device, .storage = flags.storage});
    const std::string name = choice.backend->info().name;
    if (!flags.device.empty() && name == "cpu") {
        throw Error("--device " + flags.device + ": no GPU backend can run here, --backend auto came down to " + name,
                    ErrorKind::unavailable);
    }
    return choice;
}

Eigen::Vector3d parse_triple(std::string_view text, std::string_view option) {
    const Error problem = bad_value(option, text, "three numbers X,Y,Z, or one for all three");
    std::vector<double> numbers;
    const char* at = text.data();
    const char* const end = text.data() + text.size();
    while (true) {
        double number = 0;
        const auto [next, status] = std::from_chars(at, end, number);
        if (status != std::errc{}) throw problem;
        numbers.push_back(number);
        if (next == end) break;
        if (*next != ',') throw problem;
        at = next + 1;
    }
    if (numbers.size() == 1) return Eigen::Vector3d::Constant(numbers[0]);
    if (numbers.size() != 3) throw problem;
    return {numbers[0], numbers[1], numbers[2]};
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

}  // namespace raylign::apps

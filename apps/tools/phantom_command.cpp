#include <iostream>

#include "apps/shared/commands.h"
#include "apps/shared/help.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/parse.h"
#include "core/base/error.h"
#include "raylign/io/volume.h"
#include "raylign/phantom.h"

namespace raylign::detail::apps {
namespace {

struct PhantomOptions {
    std::string kind;
    std::string size = "128,128,128";
    std::string spacing = "2,2,2";
    std::filesystem::path output;
};

Phantom phantom_of_kind(const std::string& kind, const Eigen::Vector3d& extent_mm) {
    if (kind == "spine") return spine_phantom(extent_mm);
    if (kind == "box") return box_phantom(extent_mm);
    if (kind == "ellipsoid") return ellipsoid_phantom(extent_mm);
    throw bad_value("phantom", kind, "one of spine, box, ellipsoid");
}

Eigen::Vector3i parse_size(const std::string& text) {
    const Eigen::Vector3d size = parse_triple(text, "--size");
    constexpr double kMost = 4096;  // a larger side cannot be meant
    if (!(size.minCoeff() >= 1) || !(size.maxCoeff() <= kMost) || size != size.array().floor().matrix()) {
        throw bad_value("--size", text, "whole numbers in [1, 4096]");
    }
    return size.cast<int>();
}

Eigen::Vector3d parse_spacing(const std::string& text) {
    const Eigen::Vector3d spacing_mm = parse_triple(text, "--spacing");
    if (!(spacing_mm.minCoeff() > 0) || !(spacing_mm.maxCoeff() <= 1000)) {
        throw bad_value("--spacing", text, "in (0, 1000] mm");
    }
    return spacing_mm;
}

int run_phantom(const PhantomOptions& options) {
    const Eigen::Vector3i size = parse_size(options.size);
    const Eigen::Vector3d spacing_mm = parse_spacing(options.spacing);
    const Phantom phantom = phantom_of_kind(options.kind, size.cast<double>().cwiseProduct(spacing_mm));
    const Volume volume = voxelise(phantom, centred_grid(size, spacing_mm));
    stop_if_interrupted();
    write_volume(options.output, volume);
    std::cout << options.output.string() << "\n";
    return 0;
}

}  // namespace

void add_phantom_command(CLI::App& app, Job& job) {
    const auto options = std::make_shared<PhantomOptions>();
    CLI::App& command =
        *app.add_subcommand("phantom", "Make a synthetic CT (attenuation in 1/mm: read it with --attenuation)");
    command.add_option("kind", options->kind, "spine, box or ellipsoid")->required()->option_text("(required)");
    describe(command.add_option("--size", options->size, "Voxels; one number for all three; default 128,128,128"),
             "X,Y,Z", kStartGroup);
    describe(command.add_option("--spacing", options->spacing, "Voxel sides in mm; default 2,2,2"), "X,Y,Z",
             kStartGroup);
    describe(
        command.add_option("-o,--output", options->output, "Volume to write: .mha, .nrrd, .nii or .nii.gz")->required(),
        "FILE (required)", kOutputGroup);
    finish_command(command,
                   "  raylign phantom spine -o spine.mha\n"
                   "  raylign phantom box --size 64 --spacing 1,1,2.5 -o box.nii.gz\n"
                   "  raylign drr -v spine.mha --attenuation --views views.json --pose pose.json -o xrays");
    command.callback([options, &job] { job = [options](const Invocation&) { return run_phantom(*options); }; });
}

}  // namespace raylign::detail::apps

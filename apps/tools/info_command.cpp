#include <iostream>

#include "apps/shared/commands.h"
#include "apps/shared/help.h"
#include "apps/tools/info_report.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

struct InfoOptions {
    bool json = false;
};

void print_device(const DeviceStatus& device) {
    std::cout << "      device " << device.index << "  " << device.name << "\n";
    if (!device.problem.empty()) {
        std::cout << "          cannot be used: " << device.problem << "\n";
        return;
    }
    std::cout << "          " << (device.software ? "software, taken only by name" : "hardware") << "; "
              << device.vendor << "; OpenGL " << device.version << "\n";
    std::cout << "          at most " << device.texture_3d_voxels << " voxels along an axis (" << device.texture_layers
              << " layers)";
    if (device.memory_bytes > 0) std::cout << "; " << (device.memory_bytes >> 20) << " MiB";
    if (!device.node.empty()) std::cout << "; " << device.node;
    std::cout << "\n";
}

void print_backend(const BackendStatus& status) {
    std::cout << "  " << status.name << ": " << status.summary << "\n";
    for (const DeviceStatus& device : status.devices) print_device(device);
    if (!status.available) {
        std::cout << "      cannot run here: " << status.reason << "\n";
        return;
    }
    std::cout << "      device   " << status.info.device << "\n";
    std::cout << "      threads  " << status.info.threads << "\n";
    if (status.instruction_sets.empty()) return;
    std::cout << "      kernels ";
    for (const InstructionSetStatus& set : status.instruction_sets) {
        const std::string name(instruction_set_name(set.set));
        const bool in_use = name == status.info.instruction_set;
        std::cout << " " << name << (in_use ? " (in use)" : set.available ? "" : " (not in this processor)");
    }
    std::cout << "\n";
}

int run_info(const InfoOptions& options) {
    const std::vector<BackendStatus> backends = backend_statuses();
    if (options.json) {
        std::cout << info_json(backends);
        return 0;
    }
    std::cout << "raylign " << RAYLIGN_VERSION << "\nbackends, best first:\n";
    for (const BackendStatus& status : backends) print_backend(status);
    return 0;
}

}  // namespace

void add_info_command(CLI::App& app, Job& job) {
    const auto options = std::make_shared<InfoOptions>();
    CLI::App& command = *app.add_subcommand("info", "List backends, devices and why one cannot run");
    command.add_flag("--json", options->json, "Print it as JSON; default off")->group(kOutputGroup);
    finish_command(command, "  raylign info\n  raylign info --json");
    command.callback([options, &job] { job = [options](const Invocation&) { return run_info(*options); }; });
}

}  // namespace raylign::detail::apps

#include "raylign/engines.h"

#include <algorithm>
#include <functional>

#include "backends/reference/reference_backend.h"
#include "core/base/error.h"
#ifdef RAYLIGN_WITH_CPU
#include "backends/cpu/cpu_backend.h"
#endif
#ifdef RAYLIGN_WITH_GL
#include "backends/gl/gl_backend.h"
#endif

namespace raylign {
namespace {

enum class Asked { by_name, automatically };

struct Entry {
    std::string name;
    std::string summary;
    bool automatic;  ///< may "auto" take it?
    std::function<std::unique_ptr<Backend>(const BackendOptions&, Asked)>
        create;  ///< throws Error(unavailable) where it cannot run
    std::vector<InstructionSet> instruction_sets = {};
    std::vector<std::string> storages = {"float32"};  ///< the first: the default
    std::function<std::vector<DeviceStatus>()> devices = {};
};

#ifdef RAYLIGN_WITH_GL
std::vector<DeviceStatus> gl_device_statuses() {
    std::vector<DeviceStatus> list;
    std::string problem;  // of the whole of OpenGL: the backend's own reason says it, too
    for (GlDevice& d : gl_devices(problem)) {
        list.push_back({d.index, d.name, d.vendor, d.version, d.node, d.software, d.texture_3d_voxels, d.texture_layers,
                        d.memory_bytes, d.problem});
    }
    return list;
}

GlOptions gl_options(const BackendOptions& options, Asked asked) {
    GlOptions gl{.device = options.device, .software_allowed = asked == Asked::by_name, .crop = options.crop};
    if (!options.storage.empty() && options.storage != "auto") gl.storage = options.storage;
    if (!options.interpolation.empty()) gl.interpolation = options.interpolation;
    return gl;
}
#endif

/// Best first.
std::vector<Entry> entries() {
    std::vector<Entry> list;
#ifdef RAYLIGN_WITH_GL
    list.push_back(
        {"gl",
         "OpenGL compute shaders, headless",
         true,
         [](const BackendOptions& options, Asked asked) { return make_gl_backend(gl_options(options, asked)); },
         {},
         {"auto", "float32", "int16"},
         gl_device_statuses});
#endif
#ifdef RAYLIGN_WITH_CPU
    std::vector<InstructionSet> sets;
    for (const InstructionSetStatus& set : cpu_instruction_sets()) sets.push_back({set.name, set.available});
    list.push_back({"cpu",
                    "multithreaded SIMD ray casting (TBB + xsimd)",
                    true,
                    [](const BackendOptions& options, Asked) {
                        const std::string storage = options.storage.empty() ? "auto" : options.storage;
                        return make_cpu_backend({options.threads, options.instruction_set, storage});
                    },
                    sets,
                    {"auto", "float32", "int16"}});
#endif
#ifdef RAYLIGN_WITH_GL
    list.push_back({"gl-2006",
                    "the 2006 paper's pipeline in fragment shaders, for comparison",
                    false,
                    [](const BackendOptions& options, Asked asked) {
                        PaperBaselines baselines{.slices = options.slices};
                        if (!options.reduction.empty()) baselines.reduction = options.reduction;
                        if (!options.readback.empty()) baselines.readback = options.readback;
                        return make_gl_2006_backend(gl_options(options, asked), baselines);
                    },
                    {},
                    {"auto", "float32", "int16"}});
#endif
    list.push_back({"reference", "scalar, double, one thread: the oracle", false,
                    [](const BackendOptions&, Asked) { return make_reference_backend(); }});
    return list;
}

/// Why the backend cannot keep voxels as asked; empty if it can.
std::string storage_problem(const Entry& entry, const std::string& storage) {
    if (storage.empty() || std::ranges::find(entry.storages, storage) != entry.storages.end()) return {};
    std::string allowed;
    for (const std::string& name : entry.storages) allowed += (allowed.empty() ? "" : " or ") + name;
    return bad_value("storage", storage, allowed, "the options of backend " + entry.name).what();
}

}  // namespace

std::vector<std::string> backend_names() {
    std::vector<std::string> names;
    for (const Entry& entry : entries()) names.push_back(entry.name);
    return names;
}

std::vector<BackendStatus> backend_statuses() {
    std::vector<BackendStatus> list;
    for (const Entry& entry : entries()) {
        BackendStatus status;
        status.name = entry.name;
        status.summary = entry.summary;
        status.instruction_sets = entry.instruction_sets;
        try {
            if (entry.devices) status.devices = entry.devices();
            status.info = entry.create({}, Asked::by_name)->info();
            status.available = true;
        } catch (const Error& error) {
            status.reason = error.what();
        }
        list.push_back(std::move(status));
    }
    return list;
}

BackendChoice create_backend(std::string_view name, const BackendOptions& options) {
    BackendChoice choice;
    std::string valid = "auto";
    for (const Entry& entry : entries()) {
        valid += ", " + entry.name;
        const std::string problem = storage_problem(entry, options.storage);
        if (name == entry.name) {
            if (!problem.empty()) throw Error(problem);
            return {entry.create(options, Asked::by_name), {}};
        }
        if (name != "auto" || !entry.automatic) continue;
        try {
            if (!problem.empty()) throw Error(problem, ErrorKind::unavailable);
            choice.backend = entry.create(options, Asked::automatically);
            return choice;
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::unavailable) throw;
            choice.passed_over.push_back({entry.name, entry.summary, false, error.what()});
        }
    }
    if (name == "auto") {
        std::string reasons;
        for (const BackendStatus& other : choice.passed_over) reasons += "; " + other.name + ": " + other.reason;
        throw Error("no backend can run here, see `raylign info`" + reasons, ErrorKind::unavailable);
    }
    throw bad_value("backend", name, "one of " + valid);
}

}  // namespace raylign

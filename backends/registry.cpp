#include "raylign/backends.h"

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
using namespace detail;
namespace {

enum class Asked { by_name, automatically };

struct Entry {
    std::string name;
    std::string summary;
    bool automatic;  ///< may "auto" take it?
    /// Throws Error(unavailable) where it cannot run.
    std::function<std::unique_ptr<Backend>(const BackendOptions&, Asked)> create;
    std::vector<InstructionSetStatus> instruction_sets = {};
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

Software software_for(Asked asked) { return asked == Asked::by_name ? Software::allowed : Software::refused; }
#endif

/// Best first.
std::vector<Entry> entries() {
    std::vector<Entry> list;
#ifdef RAYLIGN_WITH_GL
    list.push_back(
        {"gl",
         "OpenGL compute shaders, headless",
         true,
         [](const BackendOptions& options, Asked asked) { return make_gl_backend(options.gl, software_for(asked)); },
         {},
         gl_device_statuses});
#endif
#ifdef RAYLIGN_WITH_CPU
    list.push_back({"cpu", "multithreaded SIMD ray casting (TBB + xsimd)", true,
                    [](const BackendOptions& options, Asked) { return make_cpu_backend(options.cpu); },
                    cpu_instruction_sets()});
#endif
#ifdef RAYLIGN_WITH_GL
    list.push_back({"gl-2006", "the 2006 paper's pipeline in fragment shaders, for comparison", false,
                    [](const BackendOptions& options, Asked asked) {
                        return make_gl_2006_backend(options.gl_2006, software_for(asked));
                    }});
#endif
    list.push_back({"reference", "scalar, double, one thread: the oracle", false,
                    [](const BackendOptions&, Asked) { return make_reference_backend(); }});
    return list;
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
        if (name == entry.name) return {entry.create(options, Asked::by_name), {}};
        if (name != "auto" || !entry.automatic) continue;
        try {
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

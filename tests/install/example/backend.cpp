// tests/install/example/backend.cpp
#include <cstdio>
#include <memory>

#include "scene.h"

/// The OpenGL backend on the GPU called `device`, else the processor with four threads.
static std::unique_ptr<raylign::Backend> gpu_or_cpu(const std::string& device) {
    raylign::BackendOptions options;
    options.gl.device = device;
    options.gl.interpolation = raylign::Interpolation::exact;
    options.cpu.threads = 4;
    for (const char* name : {"gl", "cpu"}) {
        try {
            return raylign::create_backend(name, options).backend;
        } catch (const raylign::Error& error) {
            std::printf("%s: %s\n", name, error.what());  // not built, no such device, no driver
        }
    }
    return raylign::create_backend("reference").backend;  // slow, and always there
}

int main() {
    using namespace raylign;
    // What this build has, and why one cannot run here.
    for (const BackendStatus& status : backend_statuses()) {
        std::printf("%-10s %s\n", status.name.c_str(),
                    status.available ? status.info.device.c_str() : status.reason.c_str());
    }

    const std::unique_ptr<Backend> backend = gpu_or_cpu("a GPU that nobody has");
    const BackendInfo info = backend->info();
    std::printf("took %s: %d threads, %s\n", info.name.c_str(), info.threads, info.instruction_set.c_str());

    // "auto" does the same with default options; it takes neither software OpenGL nor the reference.
    bool refused = false;
    try {
        (void)create_backend("quantum");
    } catch (const Error& error) {
        refused = error.kind() == ErrorKind::input;  // the message lists the names that there are
    }
    return refused && info.name != "gl" && info.has_derivatives ? 0 : 1;
}

#include "backends/cpu/cpu_backend.h"

#include <fstream>

#include "backends/cpu/cpu_session.h"
#include "backends/cpu/kernel_dispatch.h"
#include "core/error.h"

namespace raylign {
namespace {

std::string processor_name() {
    std::ifstream info("/proc/cpuinfo");
    for (std::string line; std::getline(info, line);) {
        const auto colon = line.find(": ");
        if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
    }
    return "host processor";
}

class CpuBackend final : public Backend {
public:
    explicit CpuBackend(const CpuOptions& options)
        : kernels_(cpu::choose_kernels(options.instruction_set)),
          storage_(options.storage == "int16" ? cpu::kInt16 : cpu::kFloat32),
          threads_(options.threads > 0 ? options.threads : cpu::usable_cores()) {}

    BackendInfo info() const override {
        return {.name = "cpu",
                .summary = "multithreaded SIMD ray casting (TBB + xsimd)",
                .device = processor_name(),
                .threads = threads_,
                .instruction_set = kernels_.name};
    }
    std::unique_ptr<Session> prepare(const Scene& scene) override {
        return std::make_unique<cpu::CpuSession>(scene, kernels_, storage_, threads_);
    }

private:
    const cpu::KernelTable& kernels_;
    cpu::VoxelStorage storage_;
    int threads_;
};

}  // namespace

std::unique_ptr<Backend> make_cpu_backend(const CpuOptions& options) {
    if (options.threads < 0 || options.threads > 1024) {
        throw bad_value("threads", std::to_string(options.threads), "in [0, 1024], 0 for all cores");
    }
    if (options.storage != "float32" && options.storage != "int16") {
        throw bad_value("voxel storage", options.storage, "float32 or int16");
    }
    return std::make_unique<CpuBackend>(options);
}

}  // namespace raylign

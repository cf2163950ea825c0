#include "backends/cpu/cpu_backend.h"

#include <fstream>

#include "backends/cpu/cpu_session.h"
#include "backends/cpu/kernel_dispatch.h"
#include "backends/cpu/workers.h"
#include "core/base/error.h"

namespace raylign::detail {
namespace {

std::string processor_name() {
    std::ifstream info("/proc/cpuinfo");
    for (std::string line; std::getline(info, line);) {
        const auto colon = line.find(": ");
        if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
    }
    return "host processor";
}

cpu::StorageRule storage_rule(const CpuOptions& options, const cpu::KernelTable& kernels) {
    cpu::StorageRule rule{.max_bytes = static_cast<double>(options.max_volume_bytes), .preferred = kernels.storage};
    if (options.storage) rule.wanted = *options.storage == Storage::int16 ? cpu::kInt16 : cpu::kFloat32;
    return rule;
}

class CpuBackend final : public Backend {
public:
    explicit CpuBackend(const CpuOptions& options)
        : kernels_(cpu::choose_kernels(options.instruction_set)),
          storage_name_(options.storage ? storage_name(*options.storage) : "auto"),
          storage_(storage_rule(options, kernels_)),
          threads_(options.threads.value_or(cpu::usable_cores())) {}

    BackendInfo info() const override {
        return {.name = "cpu",
                .summary = "multithreaded SIMD ray casting (TBB + xsimd)",
                .device = processor_name(),
                .threads = threads_,
                .instruction_set = kernels_.name,
                .storage = storage_name_};
    }
    std::unique_ptr<Session> prepare(const Scene& scene) override {
        return std::make_unique<cpu::CpuSession>(scene, kernels_, storage_, threads_);
    }
    void for_each_index(std::size_t count, const std::function<void(std::size_t)>& turn) override {
        cpu::Workers(threads_).run(count, [&turn](std::size_t i, int) { turn(i); });
    }

private:
    const cpu::KernelTable& kernels_;
    std::string storage_name_;
    cpu::StorageRule storage_;
    int threads_;
};

}  // namespace

std::unique_ptr<Backend> make_cpu_backend(const CpuOptions& options) {
    if (options.threads && !(*options.threads >= 1 && *options.threads <= 1024)) {
        throw bad_value("threads", std::to_string(*options.threads), "in [1, 1024]");
    }
    return std::make_unique<CpuBackend>(options);
}

}  // namespace raylign::detail

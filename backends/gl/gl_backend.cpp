#include "backends/gl/gl_backend.h"

#include "backends/gl/gl_session.h"
#include "backends/gl/host_threads.h"
#include "backends/gl/with_api.h"
#include "core/base/error.h"
#include "core/base/usable_cores.h"

namespace raylign::detail {
namespace gl {
namespace {

/// What BackendInfo::timing says of StageClock.
const char* timing_of(const Device& device) { return device.software ? "fenced wall clock" : "timer queries"; }

int host_threads(const GlOptions& options) {
    if (options.threads && !(*options.threads >= 1 && *options.threads <= 1024)) {
        throw bad_value("threads", std::to_string(*options.threads), "in [1, 1024]");
    }
    return options.threads.value_or(usable_cores());
}

/// The device that both backends work on. A reset takes the whole context with it; the device itself comes back.
class Owner {
public:
    Owner(const Api& api, const GlOptions& options, Software software)
        : api_(api), context_(open_device(api, {options.device, software == Software::allowed})) {}

    [[nodiscard]] const Device& device() const { return context_->device(); }
    [[nodiscard]] std::shared_ptr<Context> working_context() {
        if (context_->is_lost()) context_ = std::make_shared<Context>(api_, context_->display());
        return context_;
    }

private:
    Api api_;
    std::shared_ptr<Context> context_;
};

class GlBackend final : public Backend {
public:
    GlBackend(const Api& api, const GlOptions& options, Software software)
        : options_(options), threads_(host_threads(options)), owner_(api, options, software) {}

    BackendInfo info() const override {
        return {.name = "gl",
                .summary = "OpenGL compute shaders, headless",
                .device = owner_.device().renderer,
                .threads = threads_,
                .storage = std::string(storage_name(options_.storage)),
                .interpolation = std::string(interpolation_name(options_.interpolation)),
                .timing = timing_of(owner_.device()),
                .solver = std::string(solver_name(options_.solver))};
    }
    std::unique_ptr<Session> prepare(const Scene& scene) override {
        const PipelineOptions options{.storage = options_.storage,
                                      .exact = options_.interpolation == Interpolation::exact,
                                      .crop = options_.crop,
                                      .descends = options_.solver == Solver::device};
        return std::make_unique<GlSession>(owner_.working_context(), scene, options, threads_);
    }
    void for_each_index(std::size_t count, const std::function<void(std::size_t)>& turn) override {
        on_threads(threads_, count, turn);
    }

private:
    GlOptions options_;
    int threads_;
    Owner owner_;
};

class PaperBackend final : public Backend {
public:
    PaperBackend(const Api& api, const Gl2006Options& options, Software software)
        : options_(options), threads_(host_threads(options)), owner_(api, options, software) {}

    BackendInfo info() const override {
        return {.name = "gl-2006",
                .summary = "the 2006 paper's pipeline in fragment shaders, for comparison",
                .device = owner_.device().renderer,
                .threads = threads_,
                .storage = std::string(storage_name(options_.storage)),
                .interpolation = std::string(interpolation_name(options_.interpolation)),
                .timing = timing_of(owner_.device()),
                .has_derivatives = false};
    }
    std::unique_ptr<Session> prepare(const Scene& scene) override {
        check_slices(scene.render.projector);
        const PaperOptions options{.storage = options_.storage,
                                   .exact = options_.interpolation == Interpolation::exact,
                                   .crop = options_.crop,
                                   .reduction = options_.reduction,
                                   .read_images = options_.readback == Gl2006Options::Readback::image};
        return std::make_unique<PaperSession>(owner_.working_context(), scene, options, threads_);
    }
    void for_each_index(std::size_t count, const std::function<void(std::size_t)>& turn) override {
        on_threads(threads_, count, turn);
    }

private:
    void check_slices(Projector projector) const {
        using Slices = Gl2006Options::Slices;
        const Slices fitting = projector == Projector::joseph ? Slices::object_aligned : Slices::view_aligned;
        if (!options_.slices || *options_.slices == fitting) return;
        const auto name = [](Slices s) { return s == Slices::object_aligned ? "object-aligned" : "view-aligned"; };
        throw bad_value("slices", name(*options_.slices), name(fitting),
                        "gl-2006 with projector " + std::string(projector_name(projector)));
    }

    Gl2006Options options_;
    int threads_;
    Owner owner_;
};

}  // namespace

std::unique_ptr<Backend> make_gl_backend(const Api& api, const GlOptions& options, Software software) {
    return std::make_unique<GlBackend>(api, options, software);
}

std::unique_ptr<Backend> make_gl_2006_backend(const Api& api, const Gl2006Options& options, Software software) {
    return std::make_unique<PaperBackend>(api, options, software);
}

}  // namespace gl

std::vector<GlDevice> gl_devices(std::string& problem) {
    std::vector<GlDevice> devices;
    try {
        for (const gl::DeviceEntry& entry : gl::list_devices(gl::load_api())) {
            const gl::Device& device = entry.device;
            devices.push_back({entry.index, entry.name, device.vendor, device.version, device.node, device.software,
                               device.limits.texture_3d, device.limits.texture_layers, device.limits.memory_bytes,
                               entry.problem});
        }
    } catch (const Error& error) {
        problem = error.what();
    }
    return devices;
}

std::unique_ptr<Backend> make_gl_backend(const GlOptions& options, Software software) {
    return gl::make_gl_backend(gl::load_api(), options, software);
}

std::unique_ptr<Backend> make_gl_2006_backend(const Gl2006Options& options, Software software) {
    return gl::make_gl_2006_backend(gl::load_api(), options, software);
}

}  // namespace raylign::detail

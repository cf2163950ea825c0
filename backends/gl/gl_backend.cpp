#include "backends/gl/gl_backend.h"

#include "backends/gl/engine.h"
#include "backends/gl/gl_session.h"
#include "backends/gl/paper_session.h"
#include "core/base/error.h"

namespace raylign {
namespace gl {
namespace {

/// What BackendInfo::timing says of StageClock.
const char* timing_of(const Device& device) { return device.software ? "fenced wall clock" : "timer queries"; }

Storage storage_of(const GlOptions& options) { return options.storage == "int16" ? Storage::int16 : Storage::float32; }

/// The device that both engines work on. A reset takes the whole context with it; the device itself comes back.
class Owner {
public:
    Owner(const Api& api, const GlOptions& options)
        : api_(api), context_(open_device(api, {options.device, options.software_allowed})) {}

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
    GlBackend(const Api& api, const GlOptions& options) : options_(options), owner_(api, options) {}

    BackendInfo info() const override {
        return {.name = "gl",
                .summary = "OpenGL compute shaders, headless",
                .device = owner_.device().renderer,
                .storage = options_.storage,
                .interpolation = options_.interpolation,
                .timing = timing_of(owner_.device())};
    }
    std::unique_ptr<Session> prepare(const Scene& scene) override {
        const PipelineOptions options{
            .storage = storage_of(options_), .exact = options_.interpolation == "exact", .crop = options_.crop};
        return std::make_unique<GlSession>(owner_.working_context(), scene, options);
    }

private:
    GlOptions options_;
    Owner owner_;
};

class PaperBackend final : public Backend {
public:
    PaperBackend(const Api& api, const GlOptions& options, const PaperBaselines& baselines)
        : options_(options), baselines_(baselines), owner_(api, options) {}

    BackendInfo info() const override {
        return {.name = "gl-2006",
                .summary = "the 2006 paper's pipeline in fragment shaders, for comparison",
                .device = owner_.device().renderer,
                .storage = options_.storage,
                .interpolation = options_.interpolation,
                .timing = timing_of(owner_.device()),
                .has_derivatives = false};
    }
    std::unique_ptr<Session> prepare(const Scene& scene) override {
        const bool joseph = scene.render.projector == Projector::joseph;
        if (!baselines_.slices.empty() && (baselines_.slices == "object-aligned") != joseph) {
            throw bad_value("slices", baselines_.slices, joseph ? "object-aligned" : "view-aligned",
                            "gl-2006 with projector " + std::string(projector_name(scene.render.projector)));
        }
        const PaperOptions options{.storage = storage_of(options_),
                                   .exact = options_.interpolation == "exact",
                                   .crop = options_.crop,
                                   .reduction = baselines_.reduction == "passes"   ? Reduction::passes
                                                : baselines_.reduction == "mipmap" ? Reduction::mipmap
                                                                                   : Reduction::mipmap_half,
                                   .read_images = baselines_.readback == "image"};
        return std::make_unique<PaperSession>(owner_.working_context(), scene, options);
    }

private:
    GlOptions options_;
    PaperBaselines baselines_;
    Owner owner_;
};

void check(const GlOptions& options) {
    if (options.storage != "float32" && options.storage != "int16") {
        throw bad_value("storage", options.storage, "float32 or int16");
    }
    if (options.interpolation != "hardware" && options.interpolation != "exact") {
        throw bad_value("interpolation", options.interpolation, "hardware or exact");
    }
}

void check(const PaperBaselines& baselines) {
    if (!baselines.slices.empty() && baselines.slices != "view-aligned" && baselines.slices != "object-aligned") {
        throw bad_value("slices", baselines.slices, "view-aligned or object-aligned");
    }
    if (baselines.reduction != "passes" && baselines.reduction != "mipmap" && baselines.reduction != "mipmap-half") {
        throw bad_value("reduction", baselines.reduction, "passes, mipmap or mipmap-half");
    }
    if (baselines.readback != "sums" && baselines.readback != "image") {
        throw bad_value("readback", baselines.readback, "sums or image");
    }
}

}  // namespace

std::unique_ptr<Backend> make_gl_backend(const Api& api, const GlOptions& options) {
    check(options);
    return std::make_unique<GlBackend>(api, options);
}

std::unique_ptr<Backend> make_gl_2006_backend(const Api& api, const GlOptions& options,
                                              const PaperBaselines& baselines) {
    check(options);
    check(baselines);
    return std::make_unique<PaperBackend>(api, options, baselines);
}

}  // namespace gl

std::vector<GlDevice> gl_devices(std::string& problem) {
    std::vector<GlDevice> devices;
    try {
        for (const gl::DeviceEntry& entry : gl::list_devices(gl::load_api())) {
            const gl::Device& of = entry.device;
            devices.push_back({entry.index, entry.name, of.vendor, of.version, of.node, of.software,
                               of.limits.texture_3d, of.limits.texture_layers, of.limits.memory_bytes, entry.problem});
        }
    } catch (const Error& error) {
        problem = error.what();
    }
    return devices;
}

std::unique_ptr<Backend> make_gl_backend(const GlOptions& options) {
    return gl::make_gl_backend(gl::load_api(), options);
}

std::unique_ptr<Backend> make_gl_2006_backend(const GlOptions& options, const PaperBaselines& baselines) {
    return gl::make_gl_2006_backend(gl::load_api(), options, baselines);
}

}  // namespace raylign

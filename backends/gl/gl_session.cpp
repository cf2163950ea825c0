#include "backends/gl/gl_session.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "backends/gl/descents.h"
#include "backends/gl/host_threads.h"
#include "core/base/clock.h"
#include "core/base/error.h"
#include "core/base/number_text.h"

namespace raylign::detail::gl {
namespace {

/// The paper's pipeline is kept as it was.
template <class AnyPipeline>
void check_ceilings(std::span<const View> views) {
    if constexpr (std::is_same_v<AnyPipeline, PaperPipeline>) {
        for (const View& view : views) {
            if (std::isinf(view.ceiling)) continue;
            throw bad_value("ceiling", number_text(view.ceiling), "infinite: gl-2006 has no model of saturation",
                            "view " + view.name);
        }
    }
}

}  // namespace

template <class AnyPipeline>
PipelineSession<AnyPipeline>::PipelineSession(std::shared_ptr<Context> context, const Scene& scene,
                                              const typename AnyPipeline::Options& options, int threads)
    : Session(scene), context_(std::move(context)), options_(options), threads_(threads) {
    check_ceilings<AnyPipeline>(scene.views);
    const Volume none{{.size = {1, 1, 1}}, {1}};  // of a surface no voxel goes to the device
    const Scene sent{draws_surface() ? none : scene.volume, scene.views, scene.render, scene.similarity};
    const auto on_host = [this](std::size_t count, const std::function<void(std::size_t)>& turn) {
        on_threads(threads_, count, turn);
    };
    prepare([&] {
        return DeviceScene(*context_, sent, fixed(), {options.storage, options.exact, options.crop}, on_host);
    });
}

template <class AnyPipeline>
PipelineSession<AnyPipeline>::PipelineSession(const PipelineSession& resident, std::span<const View> views,
                                              const Similarity& similarity)
    : Session(resident, views, similarity),
      context_(resident.context_),
      options_(resident.options_),
      threads_(resident.threads_) {
    check_ceilings<AnyPipeline>(views);
    prepare([&] { return DeviceScene(*resident.pipeline_, views, similarity, fixed()); });
}

template <class AnyPipeline>
template <class Make>
void PipelineSession<AnyPipeline>::prepare(const Make& make_scene) {
    const auto start = Clock::now();
    fixed_sums_ = fixed_sums(fixed());
    const Current current(*context_);
    pipeline_ = std::make_unique<AnyPipeline>(make_scene(), options_);
    if constexpr (std::is_same_v<AnyPipeline, Pipeline>) {
        if (draws_surface()) {
            pipeline_->draw_by([this](const RayFrame& frame, const RayFrameDerivatives* derivatives,
                                      const DrrTarget& target) { draw_surface(frame, derivatives, target); });
        }
    }
    timing_.prepare_s += seconds_since(start);
}

template <class AnyPipeline>
bool PipelineSession<AnyPipeline>::draws_surface() const {
    return surface() && std::is_same_v<AnyPipeline, Pipeline>;
}

template <class AnyPipeline>
std::size_t PipelineSession<AnyPipeline>::volume_bytes() const {
    return draws_surface() ? surface()->bytes() : pipeline_->volume_bytes();
}

template <class AnyPipeline>
std::string PipelineSession<AnyPipeline>::volume_layout() const {
    return draws_surface() ? surface()->description() : pipeline_->volume_text();
}

template <class AnyPipeline>
void PipelineSession<AnyPipeline>::draw_surface(const RayFrame& frame, const RayFrameDerivatives* derivatives,
                                                const DrrTarget& target) {
    const SurfaceProjection seen = surface()->project(frame, pipeline_->size_px(frame.view));
    for_each_index(seen.bands.size(),
                   [&](std::size_t band) { surface()->draw(seen, frame, derivatives, band, target); });
}

template <class AnyPipeline>
PipelineSession<AnyPipeline>::~PipelineSession() {
    try {
        const Current current(*context_);
        pipeline_.reset();
    } catch (const std::exception&) {  // the device is gone, and with it what was on it
        pipeline_.reset();
    }
}

template <class AnyPipeline>
void PipelineSession<AnyPipeline>::weights_changed() {
    const Current current(*context_);
    fixed_sums_ = fixed_sums(fixed());
    pipeline_->upload_fixed();
}

/// Runs work that waits for the device. What its stages do not account for (upload, submission, waiting, read-back)
/// counts as transfer.
template <class AnyPipeline>
template <class Work>
void PipelineSession<AnyPipeline>::timed(const Work& work) {
    const auto start = Clock::now();
    const Current current(*context_);
    work();
    note_times(seconds_since(start));
}

template <class AnyPipeline>
void PipelineSession<AnyPipeline>::note_times(double seconds) {
    counters_.bytes_to_host = pipeline_->bytes_to_host();
    const StageSeconds stages = pipeline_->collect_times();
    const double device_s = stages[0] + stages[1] + stages[2];
    timing_.drr_s += stages[0];
    timing_.gradient_s += stages[1];
    timing_.reduction_s += stages[2];
    timing_.transfer_s += std::max(seconds - device_s, 0.0);
}

template <class AnyPipeline>
void PipelineSession<AnyPipeline>::for_each_index(std::size_t count, const std::function<void(std::size_t)>& turn) {
    on_threads(threads_, count, turn);
}

template <class AnyPipeline>
MomentSums PipelineSession<AnyPipeline>::moments_of(const RayFrame& frame, std::size_t channel,
                                                    const double* found) const {
    MomentSums moments = fixed_sums_[frame.view * channel_count() + channel];
    moments.moving = found[0];
    moments.moving_moving = found[1];
    moments.fixed_moving = found[2];
    return moments;
}

template <class AnyPipeline>
void PipelineSession<AnyPipeline>::accumulate(std::span<const RayFrame> frames, std::span<MomentSums> sums) {
    timed([&] {
        const std::span<const double> found = pipeline_->run(frames, {});
        const std::size_t channels = channel_count();
        for (std::size_t i = 0; i < sums.size(); ++i) {
            sums[i] = moments_of(frames[i / channels], i % channels, &found[i * kMomentCount]);
        }
    });
}

template <class AnyPipeline>
void PipelineSession<AnyPipeline>::accumulate(std::span<const RayFrame> frames,
                                              std::span<const RayFrameDerivatives> derivatives,
                                              std::span<JacobianSums> sums) {
    timed([&] {
        const std::span<const double> found = pipeline_->run(frames, derivatives);
        const std::size_t channels = channel_count();
        for (std::size_t i = 0; i < sums.size(); ++i) {
            const double* own = &found[i * kJacobianCount];
            sums[i].moments = moments_of(frames[i / channels], i % channels, own);
            std::copy_n(own + 3, 6, sums[i].jacobian.begin());
            std::copy_n(own + 9, 6, sums[i].fixed_jacobian.begin());
            std::copy_n(own + 15, 6, sums[i].moving_jacobian.begin());
            std::copy_n(own + 21, 21, sums[i].jacobian_jacobian.begin());
        }
    });
}

template <class AnyPipeline>
bool PipelineSession<AnyPipeline>::descends() const {
    if constexpr (std::is_same_v<AnyPipeline, Pipeline>) return pipeline_->descends();
    return false;
}

template <class AnyPipeline>
std::vector<DescentEnd> PipelineSession<AnyPipeline>::run_descents(const DescentProblem& problem,
                                                                   std::span<const DescentView> views,
                                                                   std::span<const DescentStart> starts,
                                                                   std::span<const RayFrame> start_frames) {
    if constexpr (std::is_same_v<AnyPipeline, Pipeline>) {
        double seconds = 0;
        auto ends = run_on_device(*context_, *pipeline_, {problem, views, starts, start_frames, fixed_sums_}, seconds);
        const Current current(*context_);
        note_times(seconds);
        return ends;
    } else {
        return Session::run_descents(problem, views, starts, start_frames);
    }
}

template <class AnyPipeline>
Image PipelineSession<AnyPipeline>::render_frame(const RayFrame& frame) {
    Image image;
    timed([&] { image = pipeline_->render(frame); });
    return image;
}

template <class AnyPipeline>
DrrWithDerivatives PipelineSession<AnyPipeline>::render_frame(const RayFrame& frame,
                                                              const RayFrameDerivatives& derivatives) {
    DrrWithDerivatives drr;
    timed([&] { drr = pipeline_->render(frame, derivatives); });
    return drr;
}

template class PipelineSession<Pipeline>;
template class PipelineSession<PaperPipeline>;

}  // namespace raylign::detail::gl

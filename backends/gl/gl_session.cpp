#include "backends/gl/gl_session.h"

#include <algorithm>
#include <chrono>

namespace raylign::detail::gl {
namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

MomentSums moments_of(const MomentSums& fixed, const double* sums) {
    MomentSums moments = fixed;
    moments.moving = sums[0];
    moments.moving_moving = sums[1];
    moments.fixed_moving = sums[2];
    return moments;
}

}  // namespace

GlSession::GlSession(std::shared_ptr<Context> context, const Scene& scene, const PipelineOptions& options)
    : Session(scene), context_(std::move(context)) {
    const auto start = Clock::now();
    for (const View& view : scene.views) sizes_px_.push_back(view.geometry.camera.size_px);
    fixed_sums_ = fixed_sums(fixed());
    const Current current(*context_);
    pipeline_ = std::make_unique<Pipeline>(*context_, scene, fixed(), options);
    timing_.prepare_s += seconds_since(start);
}

GlSession::GlSession(const GlSession& resident, std::span<const View> views, const Similarity& similarity)
    : Session(resident, views, similarity), context_(resident.context_) {
    const auto start = Clock::now();
    for (const View& view : views) sizes_px_.push_back(view.geometry.camera.size_px);
    fixed_sums_ = fixed_sums(fixed());
    const Current current(*context_);
    pipeline_ = std::make_unique<Pipeline>(*resident.pipeline_, views, similarity, fixed());
    timing_.prepare_s += seconds_since(start);
}

std::unique_ptr<Session> GlSession::with_views(std::span<const View> views, const Similarity& similarity) {
    return std::make_unique<GlSession>(*this, views, similarity);
}

GlSession::~GlSession() {
    try {
        const Current current(*context_);
        pipeline_.reset();
    } catch (const std::exception&) {  // the device is gone, and with it what was on it
        pipeline_.reset();
    }
}

std::size_t GlSession::volume_bytes() const { return pipeline_->volume_bytes(); }
std::string GlSession::volume_layout() const { return pipeline_->volume_text(); }

void GlSession::weights_changed() {
    const Current current(*context_);
    fixed_sums_ = fixed_sums(fixed());
    pipeline_->upload_fixed(fixed());
}

/// Runs work that waits for the device. What its stages do not account for (upload, submission, waiting, read-back)
/// counts as transfer.
template <class Work>
void GlSession::timed(const Work& work) {
    const auto start = Clock::now();
    const Current current(*context_);
    work();
    const StageSeconds stages = pipeline_->collect_times();
    const double device_s = stages[0] + stages[1] + stages[2];
    timing_.drr_s += stages[0];
    timing_.gradient_s += stages[1];
    timing_.reduction_s += stages[2];
    timing_.transfer_s += std::max(seconds_since(start) - device_s, 0.0);
}

void GlSession::accumulate(std::span<const RayFrame> frames, std::span<MomentSums> sums) {
    timed([&] {
        const std::span<const double> found = pipeline_->run(frames, {});
        const std::size_t channels = channel_count();
        for (std::size_t i = 0; i < sums.size(); ++i) {
            const MomentSums& fixed_part = fixed_sums_[frames[i / channels].view * channels + i % channels];
            sums[i] = moments_of(fixed_part, &found[i * kMomentCount]);
        }
        counters_.bytes_to_host += found.size_bytes();
    });
}

void GlSession::accumulate(std::span<const RayFrame> frames, std::span<const RayFrameDerivatives> derivatives,
                           std::span<JacobianSums> sums) {
    timed([&] {
        const std::span<const double> found = pipeline_->run(frames, derivatives);
        const std::size_t channels = channel_count();
        for (std::size_t i = 0; i < sums.size(); ++i) {
            const double* own = &found[i * kJacobianCount];
            sums[i].moments = moments_of(fixed_sums_[frames[i / channels].view * channels + i % channels], own);
            std::copy_n(own + 3, 6, sums[i].jacobian.begin());
            std::copy_n(own + 9, 6, sums[i].fixed_jacobian.begin());
            std::copy_n(own + 15, 6, sums[i].moving_jacobian.begin());
            std::copy_n(own + 21, 21, sums[i].jacobian_jacobian.begin());
        }
        counters_.bytes_to_host += found.size_bytes();
    });
}

Image GlSession::render_frame(const RayFrame& frame) {
    Image image;
    timed([&] { image = pipeline_->render(frame, sizes_px_[frame.view]); });
    counters_.bytes_to_host += image.pixels.size() * sizeof(float);
    return image;
}

}  // namespace raylign::detail::gl

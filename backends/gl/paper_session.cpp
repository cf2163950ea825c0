#include "backends/gl/paper_session.h"

#include <algorithm>
#include <chrono>

#include "core/base/error.h"

namespace raylign::detail::gl {
namespace {

using Clock = std::chrono::steady_clock;
double seconds_after(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

}  // namespace

PaperSession::PaperSession(std::shared_ptr<Context> context, const Scene& scene, const PaperOptions& options)
    : Session(scene), context_(std::move(context)) {
    const auto start = Clock::now();
    fixed_sums_ = fixed_sums(fixed());
    const Current current(*context_);
    pipeline_ = std::make_unique<PaperPipeline>(*context_, scene, fixed(), options);
    timing_.prepare_s += seconds_after(start);
}

PaperSession::PaperSession(const PaperSession& resident, std::span<const View> views, const Similarity& similarity)
    : Session(resident, views, similarity), context_(resident.context_) {
    const auto start = Clock::now();
    fixed_sums_ = fixed_sums(fixed());
    const Current current(*context_);
    pipeline_ = std::make_unique<PaperPipeline>(*resident.pipeline_, views, similarity, fixed());
    timing_.prepare_s += seconds_after(start);
}

std::unique_ptr<Session> PaperSession::with_views(std::span<const View> views, const Similarity& similarity) {
    return std::make_unique<PaperSession>(*this, views, similarity);
}

PaperSession::~PaperSession() {
    try {
        const Current current(*context_);
        pipeline_.reset();
    } catch (const std::exception&) {  // the device is gone, and with it what was on it
        pipeline_.reset();
    }
}

std::size_t PaperSession::volume_bytes() const { return pipeline_->volume_bytes(); }
std::string PaperSession::volume_layout() const { return pipeline_->volume_text(); }

void PaperSession::weights_changed() {
    const Current current(*context_);
    fixed_sums_ = fixed_sums(fixed());
    pipeline_->upload_fixed();
}

/// As GlSession::timed.
template <class Work>
void PaperSession::timed(const Work& work) {
    const auto start = Clock::now();
    const Current current(*context_);
    const std::size_t bytes_before = pipeline_->bytes_to_host();
    work();
    counters_.bytes_to_host += pipeline_->bytes_to_host() - bytes_before;
    const StageSeconds stages = pipeline_->collect_times();
    timing_.drr_s += stages[0];
    timing_.gradient_s += stages[1];
    timing_.reduction_s += stages[2];
    timing_.transfer_s += std::max(seconds_after(start) - stages[0] - stages[1] - stages[2], 0.0);
}

void PaperSession::accumulate(std::span<const RayFrame> frames, std::span<MomentSums> sums) {
    timed([&] {
        const std::span<const MomentSums> found = pipeline_->run(frames);
        const std::size_t channels = channel_count();
        for (std::size_t i = 0; i < sums.size(); ++i) {
            sums[i] = fixed_sums_[frames[i / channels].view * channels + i % channels];
            sums[i].moving = found[i].moving;
            sums[i].moving_moving = found[i].moving_moving;
            sums[i].fixed_moving = found[i].fixed_moving;
        }
    });
}

void PaperSession::accumulate(std::span<const RayFrame>, std::span<const RayFrameDerivatives>,
                              std::span<JacobianSums>) {
    throw Error("gl-2006 has no analytic derivatives, like the paper: use --method steepest-descent, or --backend gl");
}

Image PaperSession::render_frame(const RayFrame& frame) {
    Image image;
    timed([&] { image = pipeline_->render(frame); });
    return image;
}

}  // namespace raylign::detail::gl

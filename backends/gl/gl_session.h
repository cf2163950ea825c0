#pragma once

#include <memory>
#include <string>
#include <vector>

#include "backends/gl/paper_pipeline.h"
#include "backends/gl/pipeline.h"
#include "core/backend.h"

namespace raylign::detail::gl {

/// A scene on a device. What is rendered on it stays there: only sums come back, as doubles, which a pipeline makes: a
/// DeviceScene that has Options and is made with them, and can run, render and upload_fixed.
template <class AnyPipeline>
class PipelineSession final : public Session {
public:
    /// `threads`: of the host.
    PipelineSession(std::shared_ptr<Context> context, const Scene& scene, const typename AnyPipeline::Options& options,
                    int threads = 1);
    /// Other views of the volume of `resident`.
    PipelineSession(const PipelineSession& resident, std::span<const View> views, const Similarity& similarity);
    ~PipelineSession() override;

    [[nodiscard]] std::size_t volume_bytes() const override;
    [[nodiscard]] std::string volume_layout() const override;
    [[nodiscard]] std::unique_ptr<Session> with_views(std::span<const View> views,
                                                      const Similarity& similarity) override {
        return std::make_unique<PipelineSession>(*this, views, similarity);
    }
    /// On threads of its own: while the host works, the device waits, and nothing else does.
    void for_each_index(std::size_t count, const std::function<void(std::size_t)>& turn) override;

protected:
    void accumulate(std::span<const RayFrame> frames, std::span<MomentSums> sums) override;
    void accumulate(std::span<const RayFrame> frames, std::span<const RayFrameDerivatives> derivatives,
                    std::span<JacobianSums> sums) override;
    Image render_frame(const RayFrame& frame) override;
    DrrWithDerivatives render_frame(const RayFrame& frame, const RayFrameDerivatives& derivatives) override;
    void weights_changed() override;
    [[nodiscard]] bool descends() const override;
    std::vector<DescentEnd> run_descents(const DescentProblem& problem, std::span<const DescentView> views,
                                         std::span<const DescentStart> starts,
                                         std::span<const RayFrame> start_frames) override;

private:
    /// True where DRRs are drawn on the host, from the volume's surface. The paper's pipeline casts rays in any case.
    [[nodiscard]] bool draws_surface() const;
    void draw_surface(const RayFrame& frame, const RayFrameDerivatives* derivatives, const DrrTarget& target);
    template <class Make>
    void prepare(const Make& make_scene);
    template <class Work>
    void timed(const Work& work);
    /// Of work that took `seconds` on the clock until the device was done.
    void note_times(double seconds);
    [[nodiscard]] MomentSums moments_of(const RayFrame& frame, std::size_t channel, const double* found) const;

    std::shared_ptr<Context> context_;
    typename AnyPipeline::Options options_;
    int threads_;
    std::unique_ptr<AnyPipeline> pipeline_;
    std::vector<MomentSums> fixed_sums_;  ///< [view][channel], the moving ones 0
};

extern template class PipelineSession<Pipeline>;
extern template class PipelineSession<PaperPipeline>;

using GlSession = PipelineSession<Pipeline>;
/// As in [Ino06]. The paper has no analytic derivatives, and so linearize throws Error.
using PaperSession = PipelineSession<PaperPipeline>;

}  // namespace raylign::detail::gl

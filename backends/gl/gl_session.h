#pragma once

#include <memory>
#include <string>
#include <vector>

#include "backends/gl/pipeline.h"
#include "core/backend.h"

namespace raylign::detail::gl {

/// A scene on a device. What is rendered on it stays there: only sums come back, as doubles in a mapped buffer.
class GlSession final : public Session {
public:
    GlSession(std::shared_ptr<Context> context, const Scene& scene, const PipelineOptions& options);
    /// Other views of the volume of `resident`.
    GlSession(const GlSession& resident, std::span<const View> views, const Similarity& similarity);
    ~GlSession() override;

    [[nodiscard]] std::size_t volume_bytes() const override;
    [[nodiscard]] std::string volume_layout() const override;
    [[nodiscard]] std::unique_ptr<Session> with_views(std::span<const View> views,
                                                      const Similarity& similarity) override;

protected:
    void accumulate(std::span<const RayFrame> frames, std::span<MomentSums> sums) override;
    void accumulate(std::span<const RayFrame> frames, std::span<const RayFrameDerivatives> derivatives,
                    std::span<JacobianSums> sums) override;
    Image render_frame(const RayFrame& frame) override;
    void weights_changed() override;

private:
    template <class Work>
    void timed(const Work& work);

    std::shared_ptr<Context> context_;
    std::unique_ptr<Pipeline> pipeline_;
    std::vector<Eigen::Vector2i> sizes_px_;
    std::vector<MomentSums> fixed_sums_;  ///< [view][channel], the moving ones 0
};

}  // namespace raylign::detail::gl

#pragma once

#include <array>
#include <span>
#include <vector>

#include "backends/gl/frame_data.h"
#include "backends/gl/scene_buffers.h"
#include "backends/gl/stage_clock.h"
#include "backends/gl/volume_textures.h"
#include "core/backend.h"

namespace raylign::detail::gl {

/// How the five sums are made: by 3x3-to-1 passes [Ino06], or as means by mipmaps [Chisu 2005], in half floats as on
/// the hardware of that time.
using Reduction = Gl2006Options::Reduction;

struct PaperOptions {
    Storage storage = Storage::int16;
    bool exact = false;
    bool crop = false;
    Reduction reduction = Reduction::passes;
    bool read_images = false;  ///< bring whole gradient images to the host instead of their sums
};

/// Size of a target that holds one texel for every 3 x 3.
[[nodiscard]] inline Eigen::Vector2i reduced(const Eigen::Vector2i& size_px) {
    return (size_px + Eigen::Vector2i::Constant(2)) / 3;
}

/// The passes of [Ino06] in fragment shaders, frame by frame: slices of the volume blended into a float image, a
/// two-pass filter with both gradients in two channels, and reductions. Object-aligned slices [LaRose 2001] make
/// projector joseph, view-aligned ones projector trilinear, which is the paper's. The context must be current in all
/// calls, the constructor and the destructor.
class PaperPipeline {
public:
    /// Numbers of slices, the last one not included.
    struct SliceRange {
        int first, end;
    };

    PaperPipeline(Context& context, const Scene& scene, const std::vector<FixedChannels>& fixed,
                  const PaperOptions& options);
    /// Other views of the volume of `resident`, whose textures both then own.
    PaperPipeline(const PaperPipeline& resident, std::span<const raylign::View> views, const Similarity& similarity,
                  const std::vector<FixedChannels>& fixed);

    /// Sums of all frames, [frame][channel], of which those of the fixed image alone are left 0. Valid until the next
    /// call.
    [[nodiscard]] std::span<const MomentSums> run(std::span<const RayFrame> frames);
    [[nodiscard]] Image render(const RayFrame& frame);
    void upload_fixed();

    [[nodiscard]] std::size_t volume_bytes() const { return volume_->bytes(); }
    [[nodiscard]] std::string volume_text() const { return volume_->text(); }
    [[nodiscard]] StageSeconds collect_times() { return clock_.collect(); }
    /// Read back so far.
    [[nodiscard]] std::size_t bytes_to_host() const { return bytes_to_host_; }

private:
    /// A texture and the framebuffer that draws into it; the second one holds the fifth sums.
    struct Target {
        Texture texture, second;
        Framebuffer framebuffer;
        Eigen::Vector2i size_px = Eigen::Vector2i::Zero();
        int levels = 1;
    };
    struct View {
        Eigen::Vector2i size_px;
        Texture fixed;
        Target drr, rows, gradients, products, steps[2];
    };
    struct Formats {
        GLenum first, second = GL_NONE;
        int levels = 1;
    };

    void take_views(std::span<const raylign::View> views);
    [[nodiscard]] Target make_mipmap(const Eigen::Vector2i& size_px);
    void make_view(const raylign::View& view);
    [[nodiscard]] Target make_target(std::string_view label, const Eigen::Vector2i& size_px, const Formats& formats);
    void begin(std::span<const RayFrame> frames);
    void upload(const RayFrame& frame);
    void draw(GLuint program, const Target& target, int instances = 1);
    void cast(const RayFrame& frame);
    void cast_slices(const View& view, int axis, const SliceRange& range);
    void filter(const View& view);
    void reduce(const View& view, int channel, std::size_t result);
    void reduce_by_passes(const View& view, std::size_t result);
    void put_result(const Target& from, const Eigen::Vector2i& size_px, std::size_t result);
    void read_results();
    void sum_on_host(const View& view, std::size_t view_index, std::size_t first_result);

    Context& context_;
    PaperOptions options_;
    RenderSettings render_;
    double step_mm_;
    int channels_;
    VoxelGrid grid_;
    std::shared_ptr<VolumeTextures> volume_;  ///< of all pipelines on this volume
    StageClock clock_;
    VertexArray vertices_;
    SceneBuffers scene_;
    Buffer draw_;
    std::vector<View> views_;
    const std::vector<FixedChannels>& fixed_;  ///< the session's
    Target results_;                           ///< one pixel per (frame, channel)
    std::vector<MomentSums> sums_;
    std::size_t bytes_to_host_ = 0;
};

}  // namespace raylign::detail::gl

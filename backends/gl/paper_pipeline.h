#pragma once

#include <array>
#include <span>
#include <vector>

#include "backends/gl/device_scene.h"

namespace raylign::detail::gl {

/// How the five sums are made: by 3x3-to-1 passes [Ino06], or as means by mipmaps [Chisu05], in half floats as on
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
class PaperPipeline final : public DeviceScene {
public:
    using Options = PaperOptions;

    /// Numbers of slices, the last one not included.
    struct SliceRange {
        int first, end;
    };

    PaperPipeline(DeviceScene scene, const PaperOptions& options);

    /// Sums of all frames, [frame][channel][sum], kMomentCount each, valid until the next call. Throws Error where
    /// derivatives are asked for: the paper has none.
    [[nodiscard]] std::span<const double> run(std::span<const RayFrame> frames,
                                              std::span<const RayFrameDerivatives> derivatives);
    [[nodiscard]] Image render(const RayFrame& frame);
    [[nodiscard]] static DrrWithDerivatives render(const RayFrame& frame, const RayFrameDerivatives& derivatives);
    void upload_fixed();

private:
    /// A texture and the framebuffer that draws into it; the second one holds the fifth sums.
    struct Target {
        Texture texture, second;
        Framebuffer framebuffer;
        Eigen::Vector2i size_px = Eigen::Vector2i::Zero();
        int levels = 1;
    };
    struct ViewTargets {
        Texture fixed;
        Target drr, rows, gradients, products, steps[2];
    };
    struct Formats {
        GLenum first, second = GL_NONE;
        int levels = 1;
    };

    [[nodiscard]] Target make_mipmap(const Eigen::Vector2i& size_px);
    void make_view(const Eigen::Vector2i& size_px);
    [[nodiscard]] Target make_target(std::string_view label, const Eigen::Vector2i& size_px, const Formats& formats);
    void begin(std::span<const RayFrame> frames);
    void upload(const RayFrame& frame);
    void draw(GLuint program, const Target& target, int instances = 1);
    void cast(const RayFrame& frame);
    void cast_slices(const ViewTargets& view, int axis, const SliceRange& range);
    void filter(const ViewTargets& view);
    void reduce(const ViewTargets& view, int channel, std::size_t result);
    void reduce_by_passes(const ViewTargets& view, std::size_t result);
    void put_result(const Target& from, const Eigen::Vector2i& size_px, std::size_t result);
    void read_results();
    void put_sums(std::size_t result, const std::array<double, kMomentCount>& sums);
    void sum_on_host(const ViewTargets& view, std::size_t view_index, std::size_t first_result);

    PaperOptions options_;
    VertexArray vertices_;
    Buffer draw_;
    std::vector<ViewTargets> views_;
    Target results_;  ///< one pixel per (frame, channel)
    std::vector<double> sums_;
};

}  // namespace raylign::detail::gl

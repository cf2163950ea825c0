#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "backends/gl/frame_data.h"
#include "backends/gl/scene_buffers.h"
#include "backends/gl/stage_clock.h"
#include "backends/gl/volume_textures.h"
#include "core/backend.h"
#include "core/base/for_each.h"

namespace raylign::detail::gl {

/// Sums that travel per (frame, channel), in double: sum w B, w B^2, w A B; with derivatives also sum w J_i, w A J_i,
/// w B J_i (6 each) and w J_i J_j (21, i <= j).
inline constexpr std::size_t kMomentCount = 3, kJacobianCount = 42;

struct VolumeOptions {
    Storage storage = Storage::int16;
    bool exact = false;  ///< interpolate from gathered texels instead of by the texture unit
    bool crop = false;   ///< keep only the box around the object
};

/// A scene on the device, as both pipelines keep it. The context must be current in all calls, the constructors and the
/// destructor; `fixed` is the session's and must outlive this.
class DeviceScene {
public:
    DeviceScene(Context& context, const Scene& scene, const std::vector<FixedChannels>& fixed,
                const VolumeOptions& options, const ForEach& on_host);
    /// Other views of the volume of `resident`, whose textures both then own.
    DeviceScene(const DeviceScene& resident, std::span<const View> views, const Similarity& similarity,
                const std::vector<FixedChannels>& fixed);
    DeviceScene(DeviceScene&&) = default;

    [[nodiscard]] std::size_t volume_bytes() const { return volume_->bytes(); }
    [[nodiscard]] std::string volume_text() const { return volume_->text(); }
    [[nodiscard]] const Eigen::Vector2i& size_px(std::size_t view) const { return sizes_px_[view]; }
    [[nodiscard]] StageSeconds collect_times() { return clock_.collect(); }
    /// Read back so far.
    [[nodiscard]] std::size_t bytes_to_host() const { return bytes_to_host_; }

protected:
    /// Makes the layouts of the volume that the rays of `frames` run through.
    void need_layouts(std::span<const RayFrame> frames, bool derivatives);
    /// Of voxels between texels by the texture unit; else by the shader.
    [[nodiscard]] bool filters_by_texture() const;
    void bind_scene() const;
    [[nodiscard]] FrameContext frame_context(const RayFrame& frame) const;

    Context& context_;
    VolumeOptions volume_options_;
    RenderSettings render_;
    VoxelGrid grid_;
    int channels_;
    std::shared_ptr<VolumeTextures> volume_;  ///< of all pipelines on this volume
    StageClock clock_;
    SceneBuffers buffers_;
    const std::vector<FixedChannels>& fixed_;  ///< the session's
    std::vector<Eigen::Vector2i> sizes_px_;    ///< of the views
    std::size_t bytes_to_host_ = 0;

private:
    DeviceScene(Context& context, const ViewScene& scene, const std::vector<FixedChannels>& fixed,
                const VolumeOptions& options, std::shared_ptr<VolumeTextures> volume);
};

/// The fixed images for shaders, view after view: (first channel, second one or 0, weight).
[[nodiscard]] std::vector<shared::vec4> fixed_pixels(std::span<const FixedChannels> fixed);

}  // namespace raylign::detail::gl

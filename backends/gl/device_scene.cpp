#include "backends/gl/device_scene.h"

#include <utility>

namespace raylign::detail::gl {

DeviceScene::DeviceScene(Context& context, const ViewScene& scene, const std::vector<FixedChannels>& fixed,
                         const VolumeOptions& options, std::shared_ptr<VolumeTextures> volume)
    : context_(context),
      volume_options_(options),
      render_(scene.render),
      grid_(scene.grid),
      channels_(channel_count(scene.similarity.metric)),
      volume_(std::move(volume)),
      clock_(context),
      buffers_(make_scene_buffers(context, scene, *volume_)),
      fixed_(fixed) {
    for (const View& view : scene.views) sizes_px_.push_back(view.geometry.camera.size_px);
}

DeviceScene::DeviceScene(Context& context, const Scene& scene, const std::vector<FixedChannels>& fixed,
                         const VolumeOptions& options, const ForEach& on_host)
    : DeviceScene(context, {scene.volume.grid, scene.views, scene.render, scene.similarity}, fixed, options,
                  std::make_shared<VolumeTextures>(
                      context, scene.volume, box_of(scene, options.crop), options.storage,
                      first_layout(scene, options.exact || context.device().emulates_filter()), on_host)) {}

DeviceScene::DeviceScene(const DeviceScene& resident, std::span<const View> views, const Similarity& similarity,
                         const std::vector<FixedChannels>& fixed)
    : DeviceScene(resident.context_, {resident.grid_, views, resident.render_, similarity}, fixed,
                  resident.volume_options_, resident.volume_) {}

void DeviceScene::need_layouts(std::span<const RayFrame> frames, bool derivatives) {
    if (render_.projector == Projector::trilinear) {
        return volume_->need(filters_by_texture() && !derivatives ? Layout::box : Layout::layers_z);
    }
    for (const RayFrame& frame : frames) {
        if (volume_->has(Layout::layers_x) && volume_->has(Layout::layers_y) && volume_->has(Layout::layers_z)) return;
        const unsigned axes = axes_met(frame, sizes_px_[frame.view]);
        for (int axis = 0; axis < 3; ++axis) {
            if (axes >> axis & 1) volume_->need(static_cast<Layout>(axis));
        }
    }
}

bool DeviceScene::filters_by_texture() const { return !volume_options_.exact && !context_.device().emulates_filter(); }

void DeviceScene::bind_scene() const {
    bind(context_.gl(), buffers_);
    volume_->bind();
}

FrameContext DeviceScene::frame_context(const RayFrame& frame) const {
    return {sizes_px_[frame.view], volume_->box().first, volume_->box().size};
}

std::vector<shared::vec4> fixed_pixels(std::span<const FixedChannels> fixed) {
    std::vector<shared::vec4> pixels;
    for (const FixedChannels& view : fixed) {
        const bool both = view.channels.size() == 2;
        pixels.reserve(pixels.size() + view.weights.pixels.size());
        for (std::size_t i = 0; i < view.weights.pixels.size(); ++i) {
            pixels.push_back(
                {view.channels[0].pixels[i], both ? view.channels[1].pixels[i] : 0, view.weights.pixels[i]});
        }
    }
    return pixels;
}

}  // namespace raylign::detail::gl

#include "backends/gl/pipeline.h"

#include <algorithm>
#include <cstring>

#include "backends/gl/programs.h"
#include "core/base/error.h"

namespace raylign::detail::gl {
namespace {

constexpr GLbitfield kReadBack = GL_MAP_READ_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;

}  // namespace

Pipeline::Pipeline(Context& context, const Scene& scene, const std::vector<FixedChannels>& fixed,
                   const PipelineOptions& options)
    : context_(context),
      options_(options),
      render_(scene.render),
      grid_(scene.volume.grid),
      channels_(channel_count(scene.similarity.metric)),
      volume_(std::make_shared<VolumeTextures>(context, scene.volume, box_of(scene, options.crop), options.storage,
                                               first_layout(scene, options.exact))),
      clock_(context) {
    take_views(scene.views, scene.similarity, fixed);
}

Pipeline::Pipeline(const Pipeline& resident, std::span<const raylign::View> views, const Similarity& similarity,
                   const std::vector<FixedChannels>& fixed)
    : context_(resident.context_),
      options_(resident.options_),
      render_(resident.render_),
      grid_(resident.grid_),
      channels_(channel_count(similarity.metric)),
      volume_(resident.volume_),
      clock_(resident.context_) {
    take_views(views, similarity, fixed);
}

void Pipeline::take_views(std::span<const raylign::View> views, const Similarity& similarity,
                          const std::vector<FixedChannels>& fixed) {
    for (const raylign::View& view : views) {
        const Eigen::Vector2i size_px = view.geometry.camera.size_px;
        views_.push_back({size_px, pixels_});
        const std::size_t pixels = static_cast<std::size_t>(size_px.x()) * size_px.y();
        pixels_ += pixels;
        image_floats_ = std::max(image_floats_, pixels);
        strips_ = std::max<std::size_t>(strips_, size_px.x() * work_groups(size_px.y(), kStripPx));
    }
    scene_ = make_scene_buffers(context_, {grid_, views, render_, similarity}, *volume_);
    if (!fixed.empty()) upload_fixed(fixed);
    context_.check("preparing the scene");
}

void Pipeline::upload_fixed(const std::vector<FixedChannels>& fixed) {
    std::vector<shared::vec4> pixels;
    pixels.reserve(pixels_);
    for (const FixedChannels& view : fixed) {
        for (std::size_t i = 0; i < view.weights.pixels.size(); ++i) {
            pixels.push_back(
                {view.channels[0].pixels[i], channels_ == 2 ? view.channels[1].pixels[i] : 0, view.weights.pixels[i]});
        }
    }
    const std::size_t bytes = pixels.size() * sizeof(pixels[0]);
    if (!fixed_) fixed_ = make_storage(context_, "fixed images", bytes);
    context_.gl().NamedBufferSubData(fixed_.id(), 0, static_cast<GLsizeiptr>(bytes), pixels.data());
    context_.check("uploading the fixed images");
}

FrameContext Pipeline::frame_context(const RayFrame& frame) const {
    return {views_[frame.view].size_px, volume_->box().first, volume_->box().size};
}

void Pipeline::upload_frames(std::span<const RayFrame> frames, std::span<const RayFrameDerivatives> derivatives) {
    const Gl& gl = context_.gl();
    std::vector<shared::FrameData> data;
    for (const RayFrame& frame : frames) data.push_back(frame_data(frame, frame_context(frame)));
    if (frames_capacity_ < frames.size()) {
        frames_ = make_storage(context_, "frames", data.size() * sizeof(data[0]));
        frames_capacity_ = frames.size();
    }
    gl.NamedBufferSubData(frames_.id(), 0, static_cast<GLsizeiptr>(data.size() * sizeof(data[0])), data.data());
    if (derivatives.empty()) return;
    std::vector<shared::DerivativeData> slopes;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        slopes.push_back(derivative_data(frames[i], derivatives[i], frame_context(frames[i])));
    }
    if (derivatives_capacity_ < frames.size()) {
        derivatives_ = make_storage(context_, "derivatives of frames", slopes.size() * sizeof(slopes[0]));
        derivatives_capacity_ = frames.size();
    }
    gl.NamedBufferSubData(derivatives_.id(), 0, static_cast<GLsizeiptr>(slopes.size() * sizeof(slopes[0])),
                          slopes.data());
}

void Pipeline::need_layouts(const Job& job) {
    if (render_.projector == Projector::trilinear) {
        if (!options_.exact) volume_->need(Layout::box);
        if (options_.exact || job.derivatives) volume_->need(Layout::layers_z);
        return;
    }
    for (const RayFrame& frame : job.frames) {
        if (volume_->has(Layout::layers_x) && volume_->has(Layout::layers_y) && volume_->has(Layout::layers_z)) return;
        const unsigned axes = axes_met(frame, views_[frame.view].size_px);
        for (int axis = 0; axis < 3; ++axis) {
            if (axes >> axis & 1) volume_->need(static_cast<Layout>(axis));
        }
    }
}

std::size_t Pipeline::bytes_per_frame(const Job& job) const {
    const std::size_t filtered = channels_ == 2 ? 2 : 0;
    return sizeof(float) * (job.images_per_frame * image_floats_ * (1 + filtered) + job.sums_per_frame * strips_);
}

void Pipeline::need_work(const Job& job, std::size_t frames) {
    const std::size_t floats = frames * job.images_per_frame * image_floats_;
    if (images_floats_ < floats) {
        images_ = make_storage(context_, "images in work", floats * sizeof(float));
        if (channels_ == 2) rows_ = make_storage(context_, "images filtered along x", 2 * floats * sizeof(float));
        images_floats_ = floats;
    }
    const std::size_t partials = frames * job.sums_per_frame * strips_;
    if (partials_floats_ < partials) {
        partials_ = make_storage(context_, "partial sums", partials * sizeof(float));
        partials_floats_ = partials;
    }
}

/// The read-back is mapped once, written by the device and read after a fence.
void Pipeline::need_sums(std::size_t count) {
    if (sums_capacity_ >= count) return;
    const std::size_t bytes = count * sizeof(double);
    sums_ = make_storage(context_, "sums", bytes, kReadBack);
    mapped_sums_ = static_cast<const double*>(
        context_.gl().MapNamedBufferRange(sums_.id(), 0, static_cast<GLsizeiptr>(bytes), kReadBack));
    context_.check("mapping the sums");
    sums_capacity_ = count;
}

void Pipeline::bind(const Job& job) const {
    const Gl& gl = context_.gl();
    gl::bind(gl, scene_);
    const auto storage = [&](StorageBinding binding, const Buffer& buffer) {
        if (buffer) gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, buffer.id());
    };
    storage(kFrameBinding, frames_);
    if (job.derivatives) storage(kDerivativeBinding, derivatives_);
    storage(kImageBinding, images_);
    storage(kRowBinding, rows_);
    storage(kFixedBinding, fixed_);
    storage(kPartialBinding, partials_);
    storage(kSumBinding, sums_);
    volume_->bind();
}

}  // namespace raylign::detail::gl

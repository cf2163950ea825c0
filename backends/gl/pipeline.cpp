#include "backends/gl/pipeline.h"

#include <algorithm>
#include <string>
#include <utility>

#include "core/base/error.h"

namespace raylign::detail::gl {
namespace {

constexpr GLbitfield kReadBack = GL_MAP_READ_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;

}  // namespace

void ReadBack::need(Context& context, std::string_view label, std::size_t count) {
    if (bytes >= count) return;
    buffer = make_storage(context, label, count, kReadBack);
    mapped = static_cast<const std::byte*>(
        context.gl().MapNamedBufferRange(buffer.id(), 0, static_cast<GLsizeiptr>(count), kReadBack));
    context.check("mapping " + std::string(label));
    bytes = count;
}

Pipeline::Pipeline(DeviceScene scene, const PipelineOptions& options)
    : DeviceScene(std::move(scene)), options_(options) {
    for (const Eigen::Vector2i& size_px : sizes_px_) {
        most_px_ = most_px_.cwiseMax(size_px);
        image_floats_ = std::max(image_floats_, static_cast<std::size_t>(size_px.x()) * size_px.y());
        blocks_ = std::max<std::size_t>(blocks_, blocks_of(size_px));
    }
    if (!fixed_.empty()) upload_fixed();
    context_.check("preparing the scene");
}

void Pipeline::upload_fixed() {
    const std::vector<shared::vec4> pixels = fixed_pixels(fixed_);
    const std::size_t bytes = pixels.size() * sizeof(pixels[0]);
    if (!fixed_images_) fixed_images_ = make_storage(context_, "fixed images", bytes);
    context_.gl().NamedBufferSubData(fixed_images_.id(), 0, static_cast<GLsizeiptr>(bytes), pixels.data());
    context_.check("uploading the fixed images");
}

void Pipeline::need_frames(std::size_t count, bool derivatives) {
    if (frames_capacity_ < count) {
        frames_ = make_storage(context_, "frames", count * sizeof(shared::FrameData));
        frames_capacity_ = count;
    }
    if (derivatives && derivatives_capacity_ < count) {
        derivatives_ = make_storage(context_, "derivatives of frames", count * sizeof(shared::DerivativeData));
        derivatives_capacity_ = count;
    }
}

void Pipeline::upload_frames(std::span<const RayFrame> frames, std::span<const RayFrameDerivatives> derivatives) {
    const Gl& gl = context_.gl();
    std::vector<shared::FrameData> data;
    for (const RayFrame& frame : frames) data.push_back(frame_data(frame, frame_context(frame)));
    need_frames(frames.size(), !derivatives.empty());
    gl.NamedBufferSubData(frames_.id(), 0, static_cast<GLsizeiptr>(data.size() * sizeof(data[0])), data.data());
    if (derivatives.empty()) return;
    std::vector<shared::DerivativeData> slopes;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        slopes.push_back(derivative_data(frames[i], derivatives[i], frame_context(frames[i])));
    }
    gl.NamedBufferSubData(derivatives_.id(), 0, static_cast<GLsizeiptr>(slopes.size() * sizeof(slopes[0])),
                          slopes.data());
}

std::size_t Pipeline::bytes_per_frame(const Job& job) const {
    return sizeof(float) * job.images_per_frame * image_floats_ + sizeof(double) * job.sums_per_frame * blocks_;
}

void Pipeline::need_work(const Job& job, std::size_t frames) {
    const std::size_t floats = frames * job.images_per_frame * image_floats_;
    if (images_floats_ < floats) {
        images_ =
            make_storage(context_, "images in work", floats * sizeof(float), drawing_ ? GL_DYNAMIC_STORAGE_BIT : 0);
        images_floats_ = floats;
    }
    const std::size_t partials = frames * job.sums_per_frame * blocks_;
    if (partials_count_ < partials) {
        partials_ = make_storage(context_, "partial sums", partials * sizeof(double), 0);
        partials_count_ = partials;
    }
}

void Pipeline::bind_work() const {
    const Gl& gl = context_.gl();
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kImageBinding, images_.id());
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kFixedBinding, fixed_images_.id());
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kPartialBinding, partials_.id());
}

void Pipeline::bind(const Job& job) const {
    const Gl& gl = context_.gl();
    bind_scene();
    const auto storage = [&](StorageBinding binding, const Buffer& buffer) {
        if (buffer) gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, buffer.id());
    };
    storage(kFrameBinding, frames_);
    if (job.derivatives) storage(kDerivativeBinding, derivatives_);
    bind_work();
    storage(kSumBinding, job.device_sums != nullptr ? *job.device_sums : sums_.buffer);
}

}  // namespace raylign::detail::gl

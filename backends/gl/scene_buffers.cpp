#include "backends/gl/scene_buffers.h"

#include <algorithm>
#include <vector>

#include "backends/gl/frame_data.h"
#include "core/base/error.h"
#include "core/image/gradient_filter.h"

namespace raylign::detail::gl {
namespace {

float f(double value) { return static_cast<float>(value); }

template <class T>
Buffer filled(Context& context, std::string_view label, const std::vector<T>& values) {
    Buffer buffer = make_storage(context, label, values.size() * sizeof(T));
    context.gl().NamedBufferSubData(buffer.id(), 0, static_cast<GLsizeiptr>(values.size() * sizeof(T)), values.data());
    return buffer;
}

/// Pairs (smoothing, derivative), with the zeros after them that strips need.
std::vector<shared::vec4> taps_of(const Similarity& similarity) {
    std::vector<shared::vec4> taps(kMostTaps);
    if (similarity.metric == Metric::ncc) return taps;
    const GradientTaps filter = gradient_taps(similarity.filter);
    for (std::size_t i = 0; i < filter.smooth.size(); ++i) {
        taps[i] = {f(filter.smooth[i]), f(filter.derivative[i])};
    }
    return taps;
}

}  // namespace

SceneBuffers make_scene_buffers(Context& context, const ViewScene& scene, const VolumeTextures& volume) {
    const Eigen::Vector3i n = volume.box().size;
    const Eigen::Vector3d& mm = scene.grid.spacing_mm;
    GLuint first_pixel = 0, most_pixels = 0, most_blocks = 0;
    std::vector<shared::ViewData> views;
    for (const View& view : scene.views) {
        const auto width = static_cast<GLuint>(view.geometry.camera.size_px.x());
        const auto height = static_cast<GLuint>(view.geometry.camera.size_px.y());
        const GLuint blocks = blocks_of(view.geometry.camera.size_px);
        views.push_back({{width, height, first_pixel, blocks}, {0.5F * (width - 1), 0.5F * (height - 1)}});
        first_pixel += width * height;
        most_pixels = std::max(most_pixels, width * height);
        most_blocks = std::max(most_blocks, blocks);
    }
    const bool gradient = scene.similarity.metric == Metric::gc;
    const auto radius = static_cast<GLuint>(gradient ? scene.similarity.filter.radius_px : 0);
    const shared::SceneData data = {
        {f(n.x()), f(n.y()), f(n.z()), f(trilinear_step_mm(scene.render, scene.grid))},
        {f(mm.x()), f(mm.y()), f(mm.z())},
        {f(volume.scale().scale_per_mm), f(volume.scale().zero)},
        {most_pixels, most_blocks, static_cast<GLuint>(channel_count(scene.similarity.metric)), radius}};
    return {filled(context, "scene", std::vector{data}), filled(context, "filter taps", taps_of(scene.similarity)),
            filled(context, "views", views)};
}

void bind(const Gl& gl, const SceneBuffers& buffers) {
    gl.BindBufferBase(GL_UNIFORM_BUFFER, kSceneBinding, buffers.scene.id());
    gl.BindBufferBase(GL_UNIFORM_BUFFER, kTapsBinding, buffers.taps.id());
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kViewBinding, buffers.views.id());
}

Buffer make_storage(Context& context, std::string_view label, std::size_t bytes, GLbitfield flags) {
    Buffer buffer = make_buffer(context.gl(), label);
    const std::size_t most = context.device().limits.storage_block_bytes;
    if (bytes <= most) {
        context.gl().NamedBufferStorage(buffer.id(), static_cast<GLsizeiptr>(std::max<std::size_t>(bytes, 16)), nullptr,
                                        flags);
    }
    if (bytes > most || !context.memory_sufficed("allocating " + std::string(label))) {
        throw Error(context.device().renderer + " has no memory for " + std::string(label) + ": " +
                        std::to_string(bytes >> 20) + " MiB (a buffer holds at most " + std::to_string(most >> 20) +
                        ")",
                    ErrorKind::unavailable);
    }
    return buffer;
}

std::vector<MomentSums> fixed_sums(const std::vector<FixedChannels>& fixed) {
    std::vector<MomentSums> all;
    for (const FixedChannels& view : fixed) {
        for (const Image& channel : view.channels) {
            MomentSums sums = moment_sums(channel, channel, view.weights);
            sums.moving = sums.moving_moving = sums.fixed_moving = 0;
            all.push_back(sums);
        }
    }
    return all;
}

Layout first_layout(const Scene& scene, bool exact) {
    if (scene.render.projector == Projector::trilinear) return exact ? Layout::layers_z : Layout::box;
    const ViewGeometry& view = scene.views.front().geometry;
    const RayFrame frame = make_ray_frame(scene.volume.grid, view, {});
    const unsigned axes = axes_met(frame, view.camera.size_px);
    return axes & 1 ? Layout::layers_x : axes & 2 ? Layout::layers_y : Layout::layers_z;
}

VoxelBox box_of(const Scene& scene, bool crop) {
    return crop ? object_box(scene.volume) : VoxelBox{Eigen::Vector3i::Zero(), scene.volume.grid.size};
}

}  // namespace raylign::detail::gl

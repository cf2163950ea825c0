#include "backends/gl/paper_pipeline.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "backends/gl/programs.h"
#include "core/base/error.h"
#include "core/base/linear_algebra.h"

namespace raylign::detail::gl {
namespace {

enum TextureUnit : GLuint { kFirstUnit = 4, kSecondUnit = 5 };  ///< after the volume's
enum SliceUniform : GLint { kFirstSlice = 1 };
constexpr GLuint kDrawBinding = 2;  ///< slice.frag
enum ReduceUniform : GLint { kChannel = 0, kSize = 1, kLevel = 2 };

constexpr int kResultsWide = 2048;  ///< results are laid out in rows of this many
constexpr double kDraw_ms = 50;     ///< half of what one submission may take

/// As DrawBlock in slice.frag.
struct DrawData {
    shared::FrameData frame;
    shared::ViewData view;
};
static_assert(sizeof(DrawData) == 112);

/// Distances from the source that the box may lie at, as numbers of steps. A point's distance is at least its depth,
/// and at least that of the box's closest point.
PaperPipeline::SliceRange shells(const RayFrame& frame, const VoxelGrid& grid, const VoxelBox& box, double step_mm) {
    Eigen::Matrix3d voxel_from_ray;
    voxel_from_ray << frame.direction_voxel, frame.step_u_voxel, frame.step_v_voxel;
    const Eigen::RowVector3d depth_row = inverse_of(voxel_from_ray).row(0);
    const Eigen::Vector3d low = (box.first - Eigen::Vector3i::Ones()).cast<double>();
    const Eigen::Vector3d high = (box.first + box.size).cast<double>();
    const Eigen::Vector3d closest = frame.source_voxel.cwiseMax(low).cwiseMin(high) - frame.source_voxel;
    double nearest_mm = 1e300, farthest_mm = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3i upper(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
        const Eigen::Vector3i voxel =
            box.first - Eigen::Vector3i::Ones() + upper.cwiseProduct(box.size + Eigen::Vector3i::Ones());
        const Eigen::Vector3d way = voxel.cast<double>() - frame.source_voxel;
        nearest_mm = std::min(nearest_mm, depth_row.dot(way));
        farthest_mm = std::max(farthest_mm, grid.spacing_mm.cwiseProduct(way).norm());
    }
    if (nearest_mm > frame.depth_max_mm) return {0, 0};
    nearest_mm = std::max(nearest_mm, grid.spacing_mm.cwiseProduct(closest).norm());  // far to a side: little depth
    constexpr double kMostSteps = 2e9;  // an int holds them; so far away nothing is seen
    return {static_cast<int>(std::clamp(std::floor(nearest_mm / step_mm - 0.5), 0.0, kMostSteps)),
            static_cast<int>(std::min(std::ceil(farthest_mm / step_mm), kMostSteps)) + 1};
}

Error no_derivatives() {
    return Error("gl-2006 has no analytic derivatives, like the paper: use --method steepest-descent, or --backend gl");
}

}  // namespace

PaperPipeline::PaperPipeline(DeviceScene scene, const PaperOptions& options)
    : DeviceScene(std::move(scene)), options_(options) {
    vertices_ = make_vertex_array(context_.gl(), "no vertices");
    draw_ = make_storage(context_, "frame and view", sizeof(DrawData));
    for (const Eigen::Vector2i& size_px : sizes_px_) make_view(size_px);
    if (!fixed_.empty()) upload_fixed();
    context_.check("preparing the scene");
}

void PaperPipeline::upload_fixed() {
    for (std::size_t v = 0; v < views_.size(); ++v) {
        const std::vector<shared::vec4> pixels = fixed_pixels({&fixed_[v], 1});
        context_.gl().TextureSubImage2D(views_[v].fixed.id(), 0, 0, 0, sizes_px_[v].x(), sizes_px_[v].y(), GL_RGBA,
                                        GL_FLOAT, pixels.data());
    }
    context_.check("uploading the fixed images");
}

void PaperPipeline::begin(std::span<const RayFrame> frames) {
    need_layouts(frames, false);
    bind_scene();
    context_.gl().BindBufferBase(GL_UNIFORM_BUFFER, kDrawBinding, draw_.id());
    context_.gl().BindVertexArray(vertices_.id());
}

/// What the slices of one frame are drawn with.
void PaperPipeline::upload(const RayFrame& frame) {
    const Eigen::Vector2i& size_px = sizes_px_[frame.view];
    DrawData data;
    data.frame = frame_data(frame, frame_context(frame));
    data.view.size_px = {static_cast<GLuint>(size_px.x()), static_cast<GLuint>(size_px.y())};
    data.view.centre_px = {0.5F * (size_px.x() - 1), 0.5F * (size_px.y() - 1)};
    context_.gl().NamedBufferSubData(draw_.id(), 0, sizeof(data), &data);
}

void PaperPipeline::draw(GLuint drawn, const Target& target, int instances) {
    const Gl& gl = context_.gl();
    gl.UseProgram(drawn);
    gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, target.framebuffer.id());
    gl.Viewport(0, 0, target.size_px.x(), target.size_px.y());
    gl.DrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, instances);
}

void PaperPipeline::cast(const RayFrame& frame) {
    const Gl& gl = context_.gl();
    upload(frame);
    const ViewTargets& view = views_[frame.view];
    constexpr std::array<GLfloat, 4> kNothing = {0, 0, 0, 0};
    gl.ClearNamedFramebufferfv(view.drr.framebuffer.id(), GL_COLOR, 0, kNothing.data());
    gl.Enable(GL_BLEND);
    gl.BlendEquation(GL_FUNC_ADD);
    gl.BlendFunc(GL_ONE, GL_ONE);
    if (render_.projector == Projector::trilinear) {
        cast_slices(view, 0, shells(frame, grid_, volume_->box(), trilinear_step_mm(render_, grid_)));
    } else {
        const unsigned axes = axes_met(frame, sizes_px_[frame.view]);
        for (int axis = 0; axis < 3; ++axis) {
            if (axes >> axis & 1) cast_slices(view, axis, {0, volume_->box().size[axis]});
        }
    }
    gl.Disable(GL_BLEND);
}

void PaperPipeline::cast_slices(const ViewTargets& view, int axis, const SliceRange& range) {
    const Gl& gl = context_.gl();
    const GLuint slice = program(context_, {{"quad.vert", "slice.frag"},
                                            {{"JOSEPH", render_.projector == Projector::joseph},
                                             {"EXACT", options_.exact},
                                             {"FILTER_BITS", emulated_bits(context_)},
                                             {"AXIS", axis},
                                             {"MAX_TAPS", kMostTaps}}});
    const double most = context_.samples_per_ms() * kDraw_ms / view.drr.size_px.cast<double>().prod();
    const int together = static_cast<int>(std::clamp(most, 1.0, 4096.0));
    for (int first = range.first; first < range.end; first += together) {
        gl.ProgramUniform1i(slice, kFirstSlice, first);
        draw(slice, view.drr, std::min(together, range.end - first));
        gl.Flush();
    }
}

void PaperPipeline::filter(const ViewTargets& view) {
    if (channels_ == 1) return;
    const Gl& gl = context_.gl();
    gl.BindTextureUnit(kFirstUnit, view.drr.texture.id());
    draw(program(context_, {{"quad.vert", "filter_rows.frag"}, {{"MAX_TAPS", kMostTaps}}}), view.rows);
    gl.BindTextureUnit(kFirstUnit, view.rows.texture.id());
    draw(program(context_, {{"quad.vert", "filter_columns.frag"}, {{"MAX_TAPS", kMostTaps}}}), view.gradients);
}

void PaperPipeline::reduce(const ViewTargets& view, int channel, std::size_t result) {
    const Gl& gl = context_.gl();
    const bool passes = options_.reduction == Reduction::passes;
    const GLuint products = program(context_, {{"quad.vert", "products.frag"}, {{"SIDE", passes ? 3 : 1}}});
    gl.ProgramUniform1i(products, kChannel, channel);
    gl.BindTextureUnit(kFirstUnit, channels_ == 2 ? view.gradients.texture.id() : view.drr.texture.id());
    gl.BindTextureUnit(kSecondUnit, view.fixed.id());
    draw(products, view.products);
    if (passes) return reduce_by_passes(view, result);
    gl.GenerateTextureMipmap(view.products.texture.id());
    gl.GenerateTextureMipmap(view.products.second.id());
    put_result(view.products, view.products.size_px, result);
}

void PaperPipeline::reduce_by_passes(const ViewTargets& view, std::size_t result) {
    const Gl& gl = context_.gl();
    const GLuint step = program(context_, {{"quad.vert", "reduce.frag"}, {{"MIPMAP", 0}}});
    const Target* from = &view.products;
    Eigen::Vector2i size_px = from->size_px;
    for (int turn = 0; size_px.maxCoeff() > 3; ++turn) {
        const Target& to = view.steps[turn % 2];
        gl.ProgramUniform2i(step, kSize, size_px.x(), size_px.y());
        gl.BindTextureUnit(kFirstUnit, from->texture.id());
        gl.BindTextureUnit(kSecondUnit, from->second.id());
        draw(step, to);
        size_px = reduced(size_px);
        from = &to;
    }
    put_result(*from, size_px, result);
}

/// Draws the last step, into the pixel of this result.
void PaperPipeline::put_result(const Target& from, const Eigen::Vector2i& size_px, std::size_t result) {
    const Gl& gl = context_.gl();
    const bool mipmap = options_.reduction != Reduction::passes;
    const GLuint last = program(context_, {{"quad.vert", "reduce.frag"}, {{"MIPMAP", mipmap}}});
    if (mipmap) {
        gl.ProgramUniform1i(last, kLevel, from.levels - 1);
    } else {
        gl.ProgramUniform2i(last, kSize, size_px.x(), size_px.y());
    }
    gl.BindTextureUnit(kFirstUnit, from.texture.id());
    gl.BindTextureUnit(kSecondUnit, from.second.id());
    gl.UseProgram(last);
    gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, results_.framebuffer.id());
    gl.Viewport(static_cast<GLint>(result % kResultsWide), static_cast<GLint>(result / kResultsWide), 1, 1);
    gl.DrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, 1);
}

void PaperPipeline::read_results() {
    const Gl& gl = context_.gl();
    const std::size_t pixels = static_cast<std::size_t>(results_.size_px.prod());
    std::vector<shared::vec4> fours(pixels);
    std::vector<float> fifths(pixels);
    const auto bytes = [](const auto& list) { return static_cast<GLsizei>(list.size() * sizeof(list[0])); };
    gl.GetTextureImage(results_.texture.id(), 0, GL_RGBA, GL_FLOAT, bytes(fours), fours.data());
    gl.GetTextureImage(results_.second.id(), 0, GL_RED, GL_FLOAT, bytes(fifths), fifths.data());
    bytes_to_host_ += static_cast<std::size_t>(bytes(fours)) + bytes(fifths);
    for (std::size_t i = 0; i < sums_.size() / kMomentCount; ++i) put_sums(i, {fours[i].z, fours[i].w, fifths[i]});
}

void PaperPipeline::put_sums(std::size_t result, const std::array<double, kMomentCount>& sums) {
    std::ranges::copy(sums, &sums_[result * kMomentCount]);
}

/// What the reductions save: the gradient images travel, and the host adds them up.
void PaperPipeline::sum_on_host(const ViewTargets& view, std::size_t view_index, std::size_t first_result) {
    const Gl& gl = context_.gl();
    const auto pixels = static_cast<std::size_t>(view.drr.size_px.prod());
    std::vector<float> packed(pixels * channels_);
    const Target& from = channels_ == 2 ? view.gradients : view.drr;
    gl.GetTextureImage(from.texture.id(), 0, channels_ == 2 ? GL_RG : GL_RED, GL_FLOAT,
                       static_cast<GLsizei>(packed.size() * sizeof(float)), packed.data());
    bytes_to_host_ += packed.size() * sizeof(float);
    Image channel(view.drr.size_px.x(), view.drr.size_px.y());
    for (int c = 0; c < channels_; ++c) {
        for (std::size_t i = 0; i < pixels; ++i) channel.pixels[i] = packed[i * channels_ + c];
        const FixedChannels& fixed = fixed_[view_index];
        const MomentSums sums = moment_sums(fixed.channels[c], channel, fixed.weights);
        put_sums(first_result + c, {sums.moving, sums.moving_moving, sums.fixed_moving});
    }
}

std::span<const double> PaperPipeline::run(std::span<const RayFrame> frames,
                                           std::span<const RayFrameDerivatives> derivatives) {
    if (!derivatives.empty()) throw no_derivatives();
    begin(frames);
    const int count = static_cast<int>(frames.size()) * channels_;
    sums_.assign(count * kMomentCount, 0);
    const Eigen::Vector2i wanted(std::min(count, kResultsWide), (count + kResultsWide - 1) / kResultsWide);
    if (!options_.read_images && results_.size_px != wanted) {
        results_ = make_target("sums", wanted, {GL_RGBA32F, GL_R32F});
    }
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const ViewTargets& view = views_[frames[i].view];
        clock_.begin();
        cast(frames[i]);
        clock_.end(Stage::drr);
        filter(view);
        clock_.end(Stage::gradient);
        if (options_.read_images) {
            sum_on_host(view, frames[i].view, i * channels_);
        } else {
            for (int c = 0; c < channels_; ++c) reduce(view, c, i * channels_ + c);
        }
        clock_.end(Stage::reduction);
    }
    context_.wait("the passes");
    if (!options_.read_images) read_results();
    context_.check("reading the sums");
    return sums_;
}

DrrWithDerivatives PaperPipeline::render(const RayFrame&, const RayFrameDerivatives&) { throw no_derivatives(); }

Image PaperPipeline::render(const RayFrame& frame) {
    begin({&frame, 1});
    clock_.begin();
    cast(frame);
    clock_.end(Stage::drr);
    context_.wait("casting rays");
    const ViewTargets& view = views_[frame.view];
    Image image(view.drr.size_px.x(), view.drr.size_px.y());
    const auto bytes = static_cast<GLsizei>(image.pixels.size() * sizeof(float));
    context_.gl().GetTextureImage(view.drr.texture.id(), 0, GL_RED, GL_FLOAT, bytes, image.pixels.data());
    bytes_to_host_ += static_cast<std::size_t>(bytes);
    context_.check("reading an image");
    return image;
}

}  // namespace raylign::detail::gl

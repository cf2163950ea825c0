#include <algorithm>
#include <cstring>

#include "backends/gl/descents.h"
#include "backends/gl/pipeline.h"

namespace raylign::detail::gl {
namespace {

enum UniformLocation : GLint { kFirstFrame = 0, kFirstRow = 1 };

const Eigen::Vector2i kSumsTile_px{16, 64};                    ///< a work group's tile (sums.comp)
constexpr int kTile_px = 8;                                    ///< side of a work group's tile (drr.comp)
constexpr std::size_t kHardwareWork = std::size_t{256} << 20;  ///< bytes of frames in work: enough to fill a GPU
constexpr std::size_t kSoftwareWork = std::size_t{16} << 20;   ///< stays near the processor's caches
constexpr double kDerivativeCost = 3;                          ///< of a DRR: four texels, and six images to filter
/// One image alone is too few rays to hide a GPU's latency: they are shared out.
constexpr int kHardwareParts = 4;

ProgramSource total_source() { return {{"total.comp"}, {{"MAX_TAPS", kMostTaps}}}; }

}  // namespace

double Pipeline::samples(std::size_t view, bool derivatives) const {
    const Eigen::Vector2i& px = sizes_px_[view];
    double planes = volume_->box().size.maxCoeff();
    if (render_.projector == Projector::trilinear) planes *= 2;
    return planes * px.x() * px.y() * (derivatives ? kDerivativeCost : 1);
}

double Pipeline::most_samples() const {
    double most = 0;
    for (std::size_t v = 0; v < sizes_px_.size(); ++v) most = std::max(most, samples(v, true));
    return most;
}

double Pipeline::all_samples() const {
    double all = 0;
    for (std::size_t v = 0; v < sizes_px_.size(); ++v) all += samples(v, true);
    return all;
}

std::vector<Chunk> Pipeline::chunks_of(const Job& job) const {
    std::vector<double> cost;
    for (const RayFrame& frame : job.frames) cost.push_back(samples(frame.view, job.derivatives));
    return plan_chunks(cost, {context_.samples_per_ms(), options_.chunk_ms, most_frames(job)});
}

std::size_t Pipeline::most_frames(const Job& job) const {
    std::size_t work = context_.device().software ? kSoftwareWork : kHardwareWork;
    if (options_.work_bytes > 0) work = options_.work_bytes;
    // Each of the buffers must fit into one block, and a frame is a layer of work groups.
    const std::size_t block =
        std::max(sizeof(float) * job.images_per_frame * image_floats_, sizeof(double) * job.sums_per_frame * blocks_);
    const Limits& limits = context_.device().limits;
    const std::size_t most = std::min({work / bytes_per_frame(job), limits.storage_block_bytes / block,
                                       static_cast<std::size_t>(limits.work_groups_z)});
    return std::max<std::size_t>(most, 1);
}

std::span<const double> Pipeline::run(std::span<const RayFrame> frames,
                                      std::span<const RayFrameDerivatives> derivatives) {
    const bool with_derivatives = !derivatives.empty();
    const Job job{frames, derivatives, with_derivatives, with_derivatives ? std::size_t{7} : 1,
                  channels_ * (with_derivatives ? kJacobianCount : kMomentCount)};
    upload_frames(frames, derivatives);
    if (!drawing_) need_layouts(job.frames, job.derivatives);
    const std::size_t sums = frames.size() * job.sums_per_frame;
    sums_.need(context_, "sums", sums * sizeof(double));
    compile(job);
    const std::vector<Chunk> chunks = chunks_of(job);
    std::size_t most = 0;
    for (const Chunk& chunk : chunks) most = std::max(most, chunk.count);
    need_work(job, most);
    bind(job);
    for (const Chunk& chunk : chunks) {
        // Not after the last one: zink of Mesa 22 takes a fence behind a flush for passed while the device still works.
        if (chunk.first > 0) context_.gl().Flush();
        run_chunk(job, chunk);
    }
    context_.gl().MemoryBarrier(GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
    context_.wait("adding up the sums");
    bytes_to_host_ += sums * sizeof(double);
    return {reinterpret_cast<const double*>(sums_.mapped), sums};
}

StageSeconds Pipeline::collect_times() {
    const StageSeconds seconds = DeviceScene::collect_times();
    const double cast_ms = 1e3 * seconds[static_cast<std::size_t>(Stage::drr)];
    if (cast_ms > 0 && cast_samples_ > 0) context_.observe_samples_per_ms(cast_samples_ / cast_ms);
    cast_samples_ = 0;
    return seconds;
}

std::vector<Image> Pipeline::cast_only(const Job& job) {
    upload_frames(job.frames, job.slopes);
    if (!drawing_) need_layouts(job.frames, job.derivatives);
    need_work(job, 1);
    bind(job);
    run_chunk(job, chunks_of(job).front());
    return read_images(job.images_per_frame, sizes_px_[job.frames.front().view]);
}

/// The first ones in work, by a copy: buffers that the host reads itself may lie in its memory, slow for the device.
std::vector<Image> Pipeline::read_images(std::size_t count, const Eigen::Vector2i& size_px) {
    const std::size_t stride = image_floats_ * sizeof(float);
    images_read_.need(context_, "images to the host", count * stride);
    context_.gl().MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    context_.gl().CopyNamedBufferSubData(images_.id(), images_read_.buffer.id(), 0, 0,
                                         static_cast<GLsizeiptr>(count * stride));
    context_.gl().MemoryBarrier(GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
    context_.wait("casting rays");
    std::vector<Image> images;
    for (std::size_t i = 0; i < count; ++i) {
        Image& image = images.emplace_back(size_px.x(), size_px.y());
        std::memcpy(image.pixels.data(), images_read_.mapped + i * stride, image.pixels.size() * sizeof(float));
        bytes_to_host_ += image.pixels.size() * sizeof(float);
    }
    return images;
}

Image Pipeline::render(const RayFrame& frame) {
    return std::move(cast_only({.frames = {&frame, 1}, .sums = false}).front());
}

DrrWithDerivatives Pipeline::render(const RayFrame& frame, const RayFrameDerivatives& derivatives) {
    std::vector<Image> images = cast_only({.frames = {&frame, 1},
                                           .slopes = {&derivatives, 1},
                                           .derivatives = true,
                                           .images_per_frame = 7,
                                           .sums = false});
    DrrWithDerivatives result{std::move(images.front()), {}};
    for (std::size_t i = 0; i < result.derivatives.size(); ++i) result.derivatives[i] = std::move(images[1 + i]);
    return result;
}

void Pipeline::run_chunk(const Job& job, const Chunk& chunk) {
    if (drawing_) {
        upload_drawn(job, chunk);
        clock_.begin();
    } else {
        clock_.begin();
        cast(job, chunk);
        clock_.end(Stage::drr);
    }
    if (job.sums) {
        add_up(job, chunk);
        clock_.end(channels_ == 2 ? Stage::gradient : Stage::reduction);
        total(job, chunk);
        clock_.end(Stage::reduction);
    }
}

void Pipeline::cast(const Job& job, const Chunk& chunk) {
    if (job.groups != nullptr) return cast_rows(job, chunk, {0, most_px_.y()});
    int height = 0;
    for (const RayFrame& frame : job.frames.subspan(chunk.first, chunk.count)) {
        height = std::max(height, sizes_px_[frame.view].y());
        cast_samples_ += samples(frame.view, job.derivatives);
    }
    const int rows = (height / chunk.row_parts + kTile_px) / kTile_px * kTile_px;
    for (int first = 0; first < height; first += rows) {
        if (first > 0) context_.gl().Flush();
        cast_rows(job, chunk, {first, std::min(rows, height - first)});
    }
}

void Pipeline::upload_drawn(const Job& job, const Chunk& chunk) {
    const std::size_t frame_floats = job.images_per_frame * image_floats_;
    drawn_.resize(std::max(drawn_.size(), chunk.count * frame_floats));
    const auto start = Clock::now();  // the device's clock does not see what is done before anything is submitted
    for (std::size_t i = 0; i < chunk.count; ++i) {
        const RayFrame& frame = job.frames[chunk.first + i];
        drawing_(frame, job.derivatives ? &job.slopes[chunk.first + i] : nullptr,
                 {&drawn_[i * frame_floats], sizes_px_[frame.view].x(), static_cast<std::ptrdiff_t>(image_floats_)});
    }
    clock_.add(Stage::drr, seconds_since(start));
    context_.gl().NamedBufferSubData(
        images_.id(), 0, static_cast<GLsizeiptr>(chunk.count * frame_floats * sizeof(float)), drawn_.data());
}

ProgramSource Pipeline::cast_source(const Job& job) const {
    const int parts = context_.device().software ? 1 : kHardwareParts;
    return {{"drr.comp"},
            {{"PARTS", options_.parts > 0 ? options_.parts : parts},
             {"JOSEPH", render_.projector == Projector::joseph},
             {"EXACT", options_.exact},
             {"FILTER_BITS", emulated_bits(context_)},
             {"DERIVATIVES", job.derivatives},
             {"MAX_TAPS", kMostTaps}}};
}

ProgramSource Pipeline::sums_source(const Job& job) const {
    return {{"sums.comp"},
            {{"GRADIENT", channels_ == 2},
             {"DERIVATIVES", job.derivatives},
             {"MOST_RADIUS", kMostRadius_px},
             {"MAX_TAPS", kMostTaps}}};
}

/// All that the job needs: drivers compile side by side what they are asked for at once.
void Pipeline::compile(const Job& job) {
    std::vector<ProgramSource> sources{sums_source(job), total_source()};
    if (!drawing_) sources.push_back(cast_source(job));
    if (job.groups != nullptr) sources.push_back(advance_source());
    make_programs(context_, sources);
}

void Pipeline::cast_rows(const Job& job, const Chunk& chunk, const Rows& rows) {
    const Gl& gl = context_.gl();
    const GLuint drr = program(context_, cast_source(job));
    gl.UseProgram(drr);
    gl.ProgramUniform1ui(drr, kFirstFrame, static_cast<GLuint>(chunk.first));
    gl.ProgramUniform1ui(drr, kFirstRow, static_cast<GLuint>(rows.first));
    dispatch(job, chunk, Pass::cast, work_groups(most_px_.x(), kTile_px), work_groups(rows.count, kTile_px));
}

void Pipeline::add_up(const Job& job, const Chunk& chunk) {
    const Gl& gl = context_.gl();
    const GLuint sums = program(context_, sums_source(job));
    gl.UseProgram(sums);
    gl.ProgramUniform1ui(sums, kFirstFrame, static_cast<GLuint>(chunk.first));
    dispatch(job, chunk, Pass::sums, work_groups(most_px_.x(), kSumsTile_px.x()),
             work_groups(most_px_.y(), kSumsTile_px.y()));
}

void Pipeline::total(const Job& job, const Chunk& chunk) {
    const Gl& gl = context_.gl();
    const GLuint total = program(context_, total_source());
    gl.UseProgram(total);
    gl.ProgramUniform1ui(total, kFirstFrame, static_cast<GLuint>(chunk.first));
    dispatch(job, chunk, Pass::total, static_cast<GLuint>(job.sums_per_frame), 1);
}

void Pipeline::fill_groups(shared::DescentData& data) const {
    data.cast_groups[0] = work_groups(most_px_.x(), kTile_px);
    data.cast_groups[1] = work_groups(most_px_.y(), kTile_px);
    data.sums_groups[0] = work_groups(most_px_.x(), kSumsTile_px.x());
    data.sums_groups[1] = work_groups(most_px_.y(), kSumsTile_px.y());
}

void Pipeline::dispatch(const Job& job, const Chunk& chunk, Pass pass, GLuint x, GLuint y) const {
    const Gl& gl = context_.gl();
    if (job.groups == nullptr) {
        gl.DispatchCompute(x, y, static_cast<GLuint>(chunk.count));
    } else {
        const std::size_t at = 9 * (chunk.first / chunk.count) + 3 * static_cast<std::size_t>(pass);
        gl.DispatchComputeIndirect(static_cast<GLintptr>(at * sizeof(GLuint)));
    }
    gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

}  // namespace raylign::detail::gl

#include <algorithm>
#include <array>

#include "backends/gl/pipeline.h"
#include "backends/gl/programs.h"

namespace raylign::detail::gl {
namespace {

enum UniformLocation : GLint { kFirstFrame, kFirstRow, kImagesPerFrame, kSumsPerFrame };

constexpr int kColumnGroup = 64;                               ///< columns of a work group (moments.comp)
constexpr std::size_t kHardwareWork = std::size_t{256} << 20;  ///< bytes of frames in work: enough to fill a GPU
constexpr std::size_t kSoftwareWork = std::size_t{16} << 20;   ///< stays near the processor's caches
/// Shapes worth trying; none of them changes a result.
constexpr std::array<std::array<int, 2>, 3> kTiles = {{{8, 8}, {16, 8}, {32, 4}}};
constexpr std::array<int, 3> kSumsPerGroup = {42, 6, 1};
constexpr double kFitSamples = 2e6;  ///< cast to time a tile shape: some ms on software OpenGL

}  // namespace

double Pipeline::samples(const RayFrame& frame) const {
    const Eigen::Vector2i& px = sizes_px_[frame.view];
    double planes = volume_->box().size.maxCoeff();
    if (render_.projector == Projector::trilinear) planes *= 2;
    return planes * px.x() * px.y();
}

std::vector<Chunk> Pipeline::chunks_of(const Job& job) const {
    constexpr double kDerivativeCost = 3;  // four texels instead of one, and six images to filter
    std::vector<double> cost;
    for (const RayFrame& frame : job.frames) cost.push_back(samples(frame) * (job.derivatives ? kDerivativeCost : 1));
    std::size_t work = context_.device().software ? kSoftwareWork : kHardwareWork;
    if (options_.work_bytes > 0) work = options_.work_bytes;
    // One image buffer, twice as large once filtered, must fit into one block, too.
    const std::size_t largest = 2 * sizeof(float) * job.images_per_frame * image_floats_;
    const std::size_t block = std::max(largest, sizeof(float) * job.sums_per_frame * strips_);
    const std::size_t most =
        std::min(work / bytes_per_frame(job), context_.device().limits.storage_block_bytes / block);
    return plan_chunks(cost, {context_.tuning().samples_per_ms, options_.chunk_ms, std::max<std::size_t>(most, 1)});
}

/// Milliseconds of what was submitted since the clock began.
double Pipeline::time_ms(Stage stage) {
    context_.wait("fitting to the device");
    return 1e3 * clock_.collect()[static_cast<std::size_t>(stage)];
}

/// Tries the shapes on the first frame; again where a much larger one comes along.
void Pipeline::fit(const Job& job) {
    Tuning& tuning = context_.tuning();
    const double frame_samples = samples(job.frames.front());
    if (frame_samples <= 4 * tuning.fitted_samples) return;
    tuning.fitted_samples = frame_samples;
    const Job one{job.frames.first(1), false, 1, channels_ * kMomentCount};
    need_work(one, 1);
    bind(one);
    const int height = sizes_px_[job.frames.front().view].y();
    const int rows = std::clamp(static_cast<int>(height * kFitSamples / frame_samples), std::min(32, height), height);
    double best_ms = 1e300;
    Tuning best = tuning;
    for (const auto& [x, y] : kTiles) {
        tuning.tile_x = x;
        tuning.tile_y = y;
        for (int turn = 0; turn < 3; ++turn) {  // the first one compiles
            clock_.begin();
            cast_rows(one, {0, 1}, {(height - rows) / 2, rows});
            clock_.end(Stage::drr);
            const double ms = time_ms(Stage::drr);
            if (turn == 0 || !(ms < best_ms)) continue;
            best_ms = ms;
            best = tuning;
        }
    }
    tuning = best;
    tuning.samples_per_ms = frame_samples * rows / height / std::max(best_ms, 1e-3);
    fit_totals(one);
}

void Pipeline::fit_totals(const Job& job) {
    Tuning& tuning = context_.tuning();
    double best_ms = 1e300;
    int best = tuning.sums_per_group;
    filter(job, {0, 1});
    for (const int sums : kSumsPerGroup) {
        tuning.sums_per_group = sums;
        for (int turn = 0; turn < 3; ++turn) {
            clock_.begin();
            total(job, {0, 1});
            clock_.end(Stage::reduction);
            const double ms = time_ms(Stage::reduction);
            if (turn == 0 || !(ms < best_ms)) continue;
            best_ms = ms;
            best = sums;
        }
    }
    tuning.sums_per_group = best;
}

std::span<const double> Pipeline::run(std::span<const RayFrame> frames,
                                      std::span<const RayFrameDerivatives> derivatives) {
    const bool with_derivatives = !derivatives.empty();
    const Job job{frames, with_derivatives, with_derivatives ? std::size_t{7} : 1,
                  channels_ * (with_derivatives ? kJacobianCount : kMomentCount)};
    upload_frames(frames, derivatives);
    need_layouts(job.frames, job.derivatives);
    need_sums(frames.size() * job.sums_per_frame);
    fit(job);
    const std::vector<Chunk> chunks = chunks_of(job);
    std::size_t most = 0;
    for (const Chunk& chunk : chunks) most = std::max(most, chunk.count);
    need_work(job, most);
    bind(job);
    for (const Chunk& chunk : chunks) run_chunk(job, chunk);
    context_.gl().MemoryBarrier(GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
    context_.wait("adding up the sums");
    bytes_to_host_ += frames.size() * job.sums_per_frame * sizeof(double);
    return {mapped_sums_, frames.size() * job.sums_per_frame};
}

/// The images of the job's one frame, left in images_.
void Pipeline::cast_only(const Job& job, std::span<const RayFrameDerivatives> derivatives) {
    upload_frames(job.frames, derivatives);
    need_layouts(job.frames, job.derivatives);
    need_work(job, 1);
    bind(job);
    run_chunk(job, chunks_of(job).front());
    context_.gl().MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    context_.wait("casting rays");
}

Image Pipeline::read_image(std::size_t image, const Eigen::Vector2i& size_px) {
    Image result(size_px.x(), size_px.y());
    const std::size_t bytes = result.pixels.size() * sizeof(float);
    context_.gl().GetNamedBufferSubData(images_.id(), static_cast<GLintptr>(image * image_floats_ * sizeof(float)),
                                        static_cast<GLsizeiptr>(bytes), result.pixels.data());
    bytes_to_host_ += bytes;
    context_.check("reading an image");
    return result;
}

Image Pipeline::render(const RayFrame& frame) {
    cast_only({.frames = {&frame, 1}, .sums = false}, {});
    return read_image(0, sizes_px_[frame.view]);
}

DrrWithDerivatives Pipeline::render(const RayFrame& frame, const RayFrameDerivatives& derivatives) {
    cast_only({.frames = {&frame, 1}, .derivatives = true, .images_per_frame = 7, .sums = false}, {&derivatives, 1});
    DrrWithDerivatives result{read_image(0, sizes_px_[frame.view]), {}};
    for (std::size_t i = 0; i < result.derivatives.size(); ++i) {
        result.derivatives[i] = read_image(1 + i, sizes_px_[frame.view]);
    }
    return result;
}

void Pipeline::run_chunk(const Job& job, const Chunk& chunk) {
    int height = 0;
    for (const RayFrame& frame : job.frames.subspan(chunk.first, chunk.count)) {
        height = std::max(height, sizes_px_[frame.view].y());
    }
    clock_.begin();
    const int tile = context_.tuning().tile_y;
    const int rows = (height / chunk.row_parts + tile) / tile * tile;
    for (int first = 0; first < height; first += rows) {
        cast_rows(job, chunk, {first, std::min(rows, height - first)});
        if (chunk.row_parts > 1) context_.gl().Flush();
    }
    clock_.end(Stage::drr);
    if (job.sums) {
        filter(job, chunk);
        clock_.end(channels_ == 2 ? Stage::gradient : Stage::reduction);
        total(job, chunk);
        clock_.end(Stage::reduction);
    }
    context_.gl().Flush();
}

void Pipeline::cast_rows(const Job& job, const Chunk& chunk, const Rows& rows) {
    const Gl& gl = context_.gl();
    const Tuning& tuning = context_.tuning();
    const GLuint drr = program(context_, {{"drr.comp"},
                                          {{"TILE_X", tuning.tile_x},
                                           {"TILE_Y", tuning.tile_y},
                                           {"JOSEPH", render_.projector == Projector::joseph},
                                           {"EXACT", options_.exact},
                                           {"DERIVATIVES", job.derivatives},
                                           {"MAX_TAPS", kMostTaps}}});
    gl.UseProgram(drr);
    gl.ProgramUniform1ui(drr, kFirstFrame, static_cast<GLuint>(chunk.first));
    gl.ProgramUniform1ui(drr, kFirstRow, static_cast<GLuint>(rows.first));
    gl.DispatchCompute(work_groups(most_px_.x(), tuning.tile_x), work_groups(rows.count, tuning.tile_y),
                       static_cast<GLuint>(chunk.count));
    gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

void Pipeline::filter(const Job& job, const Chunk& chunk) {
    const Gl& gl = context_.gl();
    const auto images = static_cast<GLuint>(chunk.count * job.images_per_frame);
    if (channels_ == 2) {
        const GLuint rows = program(context_, {{"rows.comp"}, {{"MAX_TAPS", kMostTaps}}});
        gl.UseProgram(rows);
        gl.ProgramUniform1ui(rows, kFirstFrame, static_cast<GLuint>(chunk.first));
        gl.ProgramUniform1ui(rows, kImagesPerFrame, static_cast<GLuint>(job.images_per_frame));
        gl.DispatchCompute(work_groups(most_px_.x(), 8 * kStripPx), work_groups(most_px_.y(), 8), images);
        gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    }
    for (int channel = 0; channel < (job.derivatives ? channels_ : 1); ++channel) {
        std::vector<Define> defines = {{"GRADIENT", channels_ == 2}, {"MAX_TAPS", kMostTaps}};
        if (job.derivatives) defines.push_back({"CHANNEL", channel});
        const GLuint sums = program(context_, {{job.derivatives ? "jacobian.comp" : "moments.comp"}, defines});
        gl.UseProgram(sums);
        gl.ProgramUniform1ui(sums, kFirstFrame, static_cast<GLuint>(chunk.first));
        gl.DispatchCompute(work_groups(most_px_.x(), kColumnGroup), work_groups(most_px_.y(), kStripPx),
                           static_cast<GLuint>(chunk.count));
    }
    gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

void Pipeline::total(const Job& job, const Chunk& chunk) {
    const Gl& gl = context_.gl();
    const int sums_per_group = context_.tuning().sums_per_group;
    const GLuint total =
        program(context_, {{"total.comp"}, {{"SUMS_PER_GROUP", sums_per_group}, {"MAX_TAPS", kMostTaps}}});
    gl.UseProgram(total);
    gl.ProgramUniform1ui(total, kFirstFrame, static_cast<GLuint>(chunk.first));
    gl.ProgramUniform1ui(total, kSumsPerFrame, static_cast<GLuint>(job.sums_per_frame));
    gl.DispatchCompute(work_groups(static_cast<int>(job.sums_per_frame), sums_per_group), 1,
                       static_cast<GLuint>(chunk.count));
    gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

}  // namespace raylign::detail::gl

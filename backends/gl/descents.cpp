#include "backends/gl/descents.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <utility>

#include "backends/gl/descent_data.h"
#include "core/base/clock.h"
#include "core/base/error.h"

namespace raylign::detail::gl {
namespace {

/// Of one submitted pass: 0.4 s at 10^10 samples a second, as drivers reset devices that do not answer for seconds.
/// Not by the rate that was measured: which way a search goes would depend on it.
constexpr double kMostSamples = 4e9;
/// As in advance.comp, where images, fixed pixels and partial sums have no place.
enum AdvanceBinding : GLuint { kDescentBinding = 3, kSearchBinding = 4, kModelBinding = 5, kGroupBinding = 7 };
constexpr GLint kIsFirst = 0;  ///< location of the uniform is_first

template <class T>
void write(const Gl& gl, const Buffer& buffer, std::size_t at, const T* data, std::size_t count) {
    gl.NamedBufferSubData(buffer.id(), static_cast<GLintptr>(at), static_cast<GLsizeiptr>(count * sizeof(T)), data);
}

bool has_ended(const shared::SearchData& search) {
    return search.state == shared::kDone || search.state == shared::kRefused;
}

}  // namespace

ProgramSource advance_source() { return {{"advance.comp"}, {}}; }

bool Pipeline::descends() const { return options_.descends && !drawing_ && most_samples() <= kMostSamples; }

Descents::Descents(Pipeline& pipeline, const DescentInputs& inputs)
    : pipeline_(pipeline),
      job_{.frames = {},
           .derivatives = true,
           .images_per_frame = 7,
           .sums_per_frame = pipeline.channels_ * kJacobianCount,
           .groups = &groups_,
           .device_sums = &sums_},
      views_(inputs.views.size()),
      stopped_(inputs.starts.size()) {
    pipeline.need_layouts(inputs.start_frames, true);
    const std::size_t frames = inputs.start_frames.size();
    chunk_frames_ = std::clamp<std::size_t>(static_cast<std::size_t>(kMostSamples / pipeline.most_samples()), 1,
                                            std::min(frames, pipeline.most_frames(job_)));
    chunks_ = (frames + chunk_frames_ - 1) / chunk_frames_;
    pipeline.need_frames(frames, true);
    sums_ = make_storage(pipeline.context_, "sums", frames * job_.sums_per_frame * sizeof(double), 0);
    pipeline.need_work(job_, chunk_frames_);
    upload(inputs);
    pipeline.compile(job_);
    pipeline.context_.check("preparing searches");
}

void Descents::upload(const DescentInputs& inputs) {
    Context& context = pipeline_.context_;
    const Gl& gl = context.gl();
    models_now_.resize(2 * views_ * inputs.starts.size());
    for (const DescentStart& start : inputs.starts) {
        const std::size_t trial = (2 * now_.size() + 1) * views_;
        std::ranges::transform(start.views, models_now_.begin() + static_cast<std::ptrdiff_t>(trial), model_of);
        known_.push_back(!start.views.empty());
        now_.push_back(search_from(start, inputs.problem.options.initial_damping));
    }
    const std::vector<shared::CameraData> cameras = cameras_of(inputs.views, inputs.static_sums);
    const shared::DescentData descent = descent_data(inputs.problem);
    descent_ = make_storage(context, "descent", sizeof(descent) + cameras.size() * sizeof(cameras[0]));
    write(gl, descent_, 0, &descent, 1);
    write(gl, descent_, sizeof(descent), cameras.data(), cameras.size());
    searches_ = make_storage(context, "searches", now_.size() * sizeof(now_[0]));
    write(gl, searches_, 0, now_.data(), now_.size());
    models_ = make_storage(context, "models of views", models_now_.size() * sizeof(models_now_[0]));
    write(gl, models_, 0, models_now_.data(), models_now_.size());
    groups_ = make_storage(context, "work groups", 9 * chunks_ * sizeof(GLuint), 0);
}

unsigned Descents::layouts() const {
    const VolumeTextures& volume = *pipeline_.volume_;
    if (pipeline_.render_.projector == Projector::trilinear) return 7;  // one does for all rays
    unsigned bits = 0;
    for (int axis = 0; axis < 3; ++axis) bits |= volume.has(static_cast<Layout>(axis)) ? 1U << axis : 0;
    return bits;
}

shared::DescentData Descents::descent_data(const DescentProblem& problem) const {
    shared::DescentData data = rules_of(problem, pipeline_.grid_);
    const VoxelBox& box = pipeline_.volume_->box();
    put(data.first_voxel, Eigen::Vector3d(box.first.cast<double>()));
    put(data.size_voxels, Eigen::Vector3d(box.size.cast<double>()));
    data.searches = static_cast<GLuint>(now_.size());
    data.views = static_cast<GLuint>(views_);
    data.channels = static_cast<GLuint>(pipeline_.channels_);
    data.layouts = layouts();
    data.chunk_frames = static_cast<GLuint>(chunk_frames_);
    data.chunks = static_cast<GLuint>(chunks_);
    pipeline_.fill_groups(data);
    return data;
}

void Descents::advance(bool is_first) {
    const Gl& gl = pipeline_.context_.gl();
    const GLuint program_id = program(pipeline_.context_, advance_source());
    const auto bind = [&](GLuint binding, const Buffer& buffer) {
        gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, buffer.id());
    };
    bind(kDescentBinding, descent_);
    bind(kSearchBinding, searches_);
    bind(kModelBinding, models_);
    gl.UseProgram(program_id);
    gl.ProgramUniform1ui(program_id, kIsFirst, is_first ? 1 : 0);
    gl.DispatchCompute(1, 1, 1);
    gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
    pipeline_.bind_work();
}

void Descents::submit() {
    Pipeline& p = pipeline_;
    p.bind(job_);
    p.context_.gl().BindBuffer(GL_DISPATCH_INDIRECT_BUFFER, groups_.id());
    p.context_.gl().BindBufferBase(GL_SHADER_STORAGE_BUFFER, kGroupBinding, groups_.id());
    p.clock_.begin();
    bool is_first = true;
    if (!is_begun_) {
        advance(std::exchange(is_first, false));
        is_begun_ = true;
    }
    for (unsigned step = 0; step < shared::kDescentSteps; ++step) {
        for (std::size_t c = 0; c < chunks_; ++c) p.run_chunk(job_, {c * chunk_frames_, chunk_frames_});
        p.clock_.begin();
        advance(std::exchange(is_first, false));
        p.clock_.end(Stage::reduction);
        p.context_.gl().Flush();
    }
    Submission& submission = submissions_[next_ ^ (submissions_[next_].fence ? 1U : 0U)];
    read_back(submission);
    submission.fence = p.context_.fence();
    p.context_.gl().Flush();
}

void Descents::read_back(Submission& submission) {
    Context& context = pipeline_.context_;
    const auto copy = [&](ReadBack& to, std::string_view label, const Buffer& from, std::size_t bytes) {
        to.need(context, label, bytes);
        context.gl().CopyNamedBufferSubData(from.id(), to.buffer.id(), 0, 0, static_cast<GLsizeiptr>(bytes));
        pipeline_.bytes_to_host_ += bytes;
    };
    copy(submission.searches, "searches to the host", searches_, now_.size() * sizeof(now_[0]));
    copy(submission.models, "models to the host", models_, models_now_.size() * sizeof(models_now_[0]));
    context.gl().MemoryBarrier(GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
}

std::vector<Descents::Step> Descents::next() {
    for (std::size_t i = 0; i < submissions_.size(); ++i) {
        if (!submissions_[0].fence || !submissions_[1].fence) submit();
    }
    Submission& oldest = submissions_[next_];
    pipeline_.context_.wait(*oldest.fence, "searching");
    oldest.fence.reset();
    next_ ^= 1U;
    std::memcpy(now_.data(), oldest.searches.mapped, now_.size() * sizeof(now_[0]));
    std::memcpy(models_now_.data(), oldest.models.mapped, models_now_.size() * sizeof(models_now_[0]));
    make_layouts();
    std::vector<Step> steps;
    for (std::size_t i = 0; i < now_.size(); ++i) {
        if (stopped_[i]) continue;
        const int first = static_cast<int>(now_[i].iterations - now_[i].taken) + 1;
        for (std::size_t k = 0; k < now_[i].taken; ++k) {
            steps.push_back({i,
                             {first + static_cast<int>(k), now_[i].taken_costs[k], now_[i].taken_lengths[k]},
                             pose_of(&now_[i].taken_poses[12 * k])});
        }
    }
    return steps;
}

void Descents::make_layouts() {
    unsigned needed = 0;
    for (const shared::SearchData& search : now_) {
        if (search.state == shared::kToLook) needed |= search.needed_layouts;
    }
    if (needed == 0) return;
    for (int axis = 0; axis < 3; ++axis) {
        if (needed >> axis & 1U) pipeline_.volume_->need(static_cast<Layout>(axis));
    }
    const GLuint there = layouts();
    write(pipeline_.context_.gl(), descent_, offsetof(shared::DescentData, layouts), &there, 1);
}

void Descents::stop(std::size_t search) {
    if (stopped_[search]) return;
    stopped_[search] = end_of(search);
    stopped_[search]->termination = Termination::stopped;
    const std::size_t at = search * sizeof(now_[0]) + offsetof(shared::SearchData, state);
    write(pipeline_.context_.gl(), searches_, at, &shared::kDone, 1);
}

bool Descents::done() const {
    for (std::size_t i = 0; i < now_.size(); ++i) {
        if (!stopped_[i] && !has_ended(now_[i])) return false;
    }
    return true;
}

DescentEnd Descents::end_of(std::size_t search) const {
    const shared::SearchData& now = now_[search];
    DescentEnd end{.world_from_ct = pose_of(now.base),
                   .cost = now.cost,
                   .iterations = static_cast<int>(now.iterations),
                   .linearizations = static_cast<int>(now.linearizations) - (known_[search] ? 1 : 0),
                   .last_length = now.last_length,
                   .termination = static_cast<Termination>(now.termination)};
    for (std::size_t v = 0; v < views_; ++v) {
        end.views.push_back(linearization_of(models_now_[2 * views_ * search + v]));
    }
    if (now.state == shared::kRefused) end.refused = pose_of(now.trial);
    return end;
}

std::vector<DescentEnd> Descents::ends() const {
    std::vector<DescentEnd> all;
    for (std::size_t i = 0; i < now_.size(); ++i) {
        all.push_back(stopped_[i] ? *stopped_[i] : end_of(i));
        pipeline_.cast_samples_ += all.back().linearizations * pipeline_.all_samples();
    }
    return all;
}

namespace {

/// Their buffers are the context's.
struct Owned {
    Context& context;
    std::optional<Descents> searches{};

    ~Owned() {
        try {
            const Current current(context);
            searches.reset();
        } catch (const std::exception&) {  // the device is gone, and with it what was on it
            searches.reset();
        }
    }
};

}  // namespace

std::vector<DescentEnd> run_on_device(Context& context, Pipeline& pipeline, const DescentInputs& inputs,
                                      double& seconds) {
    Owned owned{context};
    const auto on_device = [&](const auto& work) {
        const auto start = Clock::now();
        const Current current(context);
        work();
        seconds += seconds_since(start);
    };
    on_device([&] { owned.searches.emplace(pipeline, inputs); });
    Descents& searches = *owned.searches;
    const DescentProblem& problem = inputs.problem;
    std::vector<Descents::Step> steps;
    while (!searches.done()) {
        problem.before_batch();
        on_device([&] { steps = searches.next(); });
        for (const Descents::Step& s : steps) {
            if (searches.is_stopped(s.search)) continue;  // it went on until it could be told
            if (!problem.on_step || problem.on_step(s.search, s.step, s.world_from_ct)) continue;
            on_device([&] { searches.stop(s.search); });
        }
    }
    return searches.ends();
}

}  // namespace raylign::detail::gl

#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "backends/gl/pipeline.h"
#include "core/descent.h"

namespace raylign::detail::gl {

[[nodiscard]] ProgramSource advance_source();

struct DescentInputs {
    const DescentProblem& problem;
    std::span<const DescentView> views;
    std::span<const DescentStart> starts;
    std::span<const RayFrame> start_frames;   ///< of all starts, pose-major
    std::span<const MomentSums> static_sums;  ///< [view][channel], those with the moving image 0
};

/// Levenberg-Marquardt searches that the device runs by itself, a few steps of each at a time (advance.comp): while it
/// works on those, the next ones are submitted already, so that it never waits for the host. The context must be
/// current in all calls, the constructor and the destructor; the pipeline must do nothing else meanwhile.
class Descents {
public:
    Descents(Pipeline& pipeline, const DescentInputs& inputs);
    Descents(const Descents&) = delete;
    Descents& operator=(const Descents&) = delete;

    /// A step that a search has accepted.
    struct Step {
        std::size_t search;
        OptimizerStep step;
        RigidTransform world_from_ct;
    };
    /// Waits for the oldest submission: the steps it brought, in the order of each search.
    [[nodiscard]] std::vector<Step> next();
    /// Ends a search from outside, where it is by now.
    void stop(std::size_t search);
    [[nodiscard]] bool is_stopped(std::size_t search) const { return stopped_[search].has_value(); }
    /// As far as next() has told.
    [[nodiscard]] bool done() const;
    [[nodiscard]] std::vector<DescentEnd> ends() const;

private:
    /// What the host reads after a submission.
    struct Submission {
        ReadBack searches, models;
        std::optional<Fence> fence;
    };

    void upload(const DescentInputs& inputs);
    [[nodiscard]] shared::DescentData descent_data(const DescentProblem& problem) const;
    [[nodiscard]] unsigned layouts() const;
    void submit();
    void advance(bool is_first);
    void read_back(Submission& submission);
    void make_layouts();
    [[nodiscard]] DescentEnd end_of(std::size_t search) const;

    Pipeline& pipeline_;
    Pipeline::Job job_;
    std::size_t chunk_frames_, chunks_, views_;
    bool is_begun_ = false;
    std::vector<bool> known_;                         ///< at the start
    std::vector<std::optional<DescentEnd>> stopped_;  ///< from outside
    Buffer descent_, searches_, models_, groups_, sums_;
    std::array<Submission, 2> submissions_;
    std::size_t next_ = 0;                       ///< of submissions_, to be read
    std::vector<shared::SearchData> now_;        ///< as read last
    std::vector<shared::ViewModel> models_now_;  ///< [search][base, trial][view]
};

/// All of them to their ends. The context is current in what this calls of itself only: what the problem calls may have
/// work of its own there. `seconds`: of the clock, spent with the device.
[[nodiscard]] std::vector<DescentEnd> run_on_device(Context& context, Pipeline& pipeline, const DescentInputs& inputs,
                                                    double& seconds);

}  // namespace raylign::detail::gl

#pragma once

#include <chrono>
#include <memory>
#include <optional>

#include "core/registration/level/methods.h"
#include "core/registration/level/plan.h"
#include "core/registration/object/overlap.h"
#include "core/registration/registration.h"
#include "core/registration/object/resident_volume.h"

namespace raylign {

/// Thrown between batches when the time limit is over; never leaves register_volume.
struct TimeIsUp {};

/// What all parts of one registration share.
struct RunContext {
    using Clock = std::chrono::steady_clock;

    ResidentVolume& resident;
    const Volume& volume;
    std::span<const View> views;
    const RegistrationOptions& options;
    Backend& backend;
    const ProgressCallback& progress;
    ObjectExtent extent;
    const ObjectSample& sample;
    RigidTransform start;
    RegistrationResult result{};
    Clock::time_point begin = Clock::now();
    double total_work = 1, done_work = 0;  ///< in units of level_work
    int level_count = 1;                   ///< planned so far
    int levels_made = 0;

    [[nodiscard]] double elapsed_s() const { return std::chrono::duration<double>(Clock::now() - begin).count(); }
    /// Before every batch. Throws Error(cancelled) or TimeIsUp.
    void check_hooks() const;
    /// Tells the caller how far it is: `work` units beyond what is done. Throws Error(cancelled) where it says so.
    void show_progress(int level, double work, double cost, int iteration = 0) const;
};

/// Share of a level in the time of a run, in arbitrary units.
[[nodiscard]] double level_work(const LevelPlan& plan);

/// Where the images of a level are cut to: around the object at a pose. What lies beyond the margin has no weight in a
/// part's registration; without it engines have less to filter and sum.
struct Focus {
    RigidTransform world_from_ct;
    double margin_mm;  ///< at the object
};

/// One resolution, resident on the engine. What it counted is added to the result when it ends.
class Level {
public:
    Level(RunContext& run, const LevelPlan& plan, Content content, const std::optional<Focus>& focus = {});
    ~Level();
    Level(const Level&) = delete;
    Level& operator=(const Level&) = delete;

    [[nodiscard]] Session& session() { return *session_; }
    [[nodiscard]] std::span<const View> views() const { return views_; }
    [[nodiscard]] const LevelPlan& plan() const { return plan_; }
    [[nodiscard]] int index() const { return index_; }
    [[nodiscard]] LevelReport& report() { return report_; }
    [[nodiscard]] double cost(const RigidTransform& world_from_ct);
    [[nodiscard]] LevelProblem problem(const RigidTransform& start, bool finest) {
        return problem(start, finest, *session_);
    }
    /// The same for a session cut from this level.
    [[nodiscard]] LevelProblem problem(const RigidTransform& start, bool finest, Session& session);
    /// What the views show around the object at a pose, and nothing else: a small search has less to filter and sum
    /// there. `images`, one per view, are cut alike, into `cut`. None where too little is left of a view. Count what
    /// it does by count().
    [[nodiscard]] std::unique_ptr<Session> cut_out(const RigidTransform& world_from_ct, std::span<const Image> images,
                                                   std::vector<Image>& cut);
    void count(const Session& cut_out);
    /// The method of the run from `start`; records its steps, moves result.world_from_ct, adds to the report.
    LevelOutcome optimize(const RigidTransform& start, bool finest, double initial_step_mm);
    /// Throws Error where the DRR at the start misses a view.
    void check_overlap();

private:
    void record(const OptimizerStep& step, const RigidTransform& pose);

    RunContext& run_;
    void make_views(const std::optional<Focus>& focus);

    LevelPlan plan_;
    int index_;
    std::vector<View> views_;
    std::unique_ptr<Session> session_;
    SessionCounters counters_;  ///< of sessions cut from this level
    LevelReport report_;
    RunContext::Clock::time_point begin_ = RunContext::Clock::now();
};

}  // namespace raylign

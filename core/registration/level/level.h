#pragma once

#include <memory>
#include <optional>

#include "core/registration/level/methods.h"
#include "core/registration/level/plan.h"
#include "core/registration/level/run.h"

namespace raylign::detail {

/// Share of a level in the time of a run, in arbitrary units.
[[nodiscard]] double level_work(const LevelPlan& plan);

/// Where the images of a level are cut to: around the object at a pose. What lies beyond the margin has no weight in a
/// part's registration; without it backends have less to filter and sum.
struct Focus {
    RigidTransform world_from_ct;
    double margin_mm;  ///< at the object
};

/// One resolution, resident on the backend. What was counted on it reaches the result by close().
class Level {
public:
    Level(Run& run, const LevelPlan& plan, Content content, const std::optional<Focus>& focus = {});

    [[nodiscard]] Session& session() { return *session_; }
    [[nodiscard]] std::span<const View> views() const { return views_; }
    [[nodiscard]] const LevelPlan& plan() const { return plan_; }
    [[nodiscard]] int index() const { return index_; }
    [[nodiscard]] LevelReport& report() { return report_; }
    [[nodiscard]] const LevelReport& report() const { return report_; }
    /// Costs of a pose with the session's weights; what is known already is not evaluated again.
    [[nodiscard]] std::vector<double> view_costs(const RigidTransform& world_from_ct);
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
    /// Puts the result, which a coarser level found, back to the run's start where that costs less here: a coarser
    /// level may have gone astray. `may_restart` false: no coarser level has been asked, and only the report's first
    /// cost is set.
    void take_the_better_start(bool may_restart);
    /// The method of the run from `start`; records its steps, moves result.world_from_ct, adds to the report.
    LevelOutcome optimize(const RigidTransform& start, bool finest, double initial_step_mm);
    /// The same from the result so far, which is near a minimum.
    void settle(bool finest);
    /// Throws Error where the DRR at the start misses a view.
    void check_overlap();
    /// Whether its volume goes on beyond the CT's cut faces (object/continued.h): a whole's, where the X-ray is known
    /// to show more than the CT, on all levels but the finest.
    [[nodiscard]] bool is_continued() const { return is_continued_; }
    [[nodiscard]] bool may_continue() const;  ///< a side is cut, and the level is not the finest
    /// Changes that, where it may; weights are the masks' again.
    void go_beyond_the_cut(bool goes_on);
    /// DRRs of all views show no more than this from now on (View::ceiling); weights stay.
    void show_up_to(double ceiling);
    /// Adds what was counted to the result: once, when the work on the level has ended, however it ended.
    void close();

private:
    void make_views(const std::optional<Focus>& focus);
    /// The level's views on its volume, as far as it goes, with its filter.
    [[nodiscard]] std::unique_ptr<Session> make_session();
    LevelOutcome solve(LevelProblem problem);
    void renew_session();
    void record(const OptimizerStep& step, const RigidTransform& pose);

    Run& run_;
    LevelPlan plan_;
    int index_;
    std::vector<View> views_;
    std::unique_ptr<Session> session_;
    /// What is known of a pose with the weights in use.
    struct Known {
        RigidTransform world_from_ct;
        std::vector<double> view_costs;
        std::vector<Linearization> views{};  ///< empty: not linearized, or no longer of use
    };
    /// Null where nothing is. What was known with other weights is forgotten.
    [[nodiscard]] Known* known(const RigidTransform& world_from_ct);
    void remember(const RigidTransform& world_from_ct, std::vector<Linearization> views);
    /// So that the method, which begins there, need not.
    void linearize(const RigidTransform& world_from_ct);

    std::vector<Known> known_;
    std::uint64_t known_weights_ = 0;  ///< Session::weight_changes of known_
    bool is_continued_ = false;
    SessionCounters counters_;  ///< of sessions cut from this level
    LevelReport report_;
};

/// One level from its making to its closing, also where a stop or an error ends the work.
template <class Work>
void on_level(Run& run, const LevelPlan& plan, Content content, const std::optional<Focus>& focus, const Work& work) {
    Level level(run, plan, content, focus);
    try {
        work(level);
    } catch (...) {
        level.close();
        throw;
    }
    level.close();
}

/// A level of a whole in other views or from another pose than the run's: work(its run, level). The report leaves it
/// out; what it cost counts, and the time limit is the run's.
template <class Work>
void on_level_beside(Run& run, std::span<const View> views, const LevelPlan& plan, const Work& work) {
    const RunControl quiet{.on_progress = {}, .stop = run.control.stop, .meanwhile = run.control.meanwhile};
    Run beside{run.resident, views, run.options, quiet, run.extent, run.start};
    beside.begin = run.begin;
    beside.shows_the_cut = run.shows_the_cut;
    on_level(beside, plan, Content::whole, std::nullopt, [&](Level& level) { work(beside, level); });
    add(run.result.counters, beside.result.counters);
    add(run.result.timing, beside.result.timing);
}

}  // namespace raylign::detail

#include "core/registration/level/run.h"

#include <algorithm>

namespace raylign::detail {

void add(SessionTiming& sum, const SessionTiming& more) {
    sum.prepare_s += more.prepare_s;
    sum.drr_s += more.drr_s;
    sum.gradient_s += more.gradient_s;
    sum.reduction_s += more.reduction_s;
    sum.transfer_s += more.transfer_s;
}

void add(SessionCounters& sum, const SessionCounters& more) {
    sum.evaluations += more.evaluations;
    sum.linearizations += more.linearizations;
    sum.bytes_to_host += more.bytes_to_host;
}

void LevelClock::count_until(Clock::time_point now) {
    if (!open_.empty()) open_.back().time_s += std::chrono::duration<double>(now - counted_).count();
    counted_ = now;
}

void LevelClock::open(int level, Clock::time_point since) {
    count_until(since);
    open_.push_back({level, 0});
}

double LevelClock::close(int level) {
    count_until(Clock::now());
    const auto found = std::ranges::find(open_, level, &Open::level);
    const double time_s = found->time_s;
    open_.erase(found);
    return time_s;
}

void stop_if_asked(const Run& run) {
    if (run.control.meanwhile) run.control.meanwhile();
    if (run.control.stop.stop_requested()) throw RunStopped{Termination::stopped};
    if (run.options.time_limit_s && run.elapsed_s() > *run.options.time_limit_s) {
        throw RunStopped{Termination::time_limit};
    }
}

void show_progress(const Run& run, int level, double work, double cost, int iteration) {
    if (!run.control.on_progress) return;
    const double fraction = std::min(1.0, (run.done_work + work) / run.total_work);
    run.control.on_progress({.level = level,
                             .levels = run.level_count,
                             .iteration = iteration,
                             .cost = cost,
                             .fraction = fraction,
                             .remaining_s = run.elapsed_s() * (1 - fraction) / std::max(fraction, 1e-3)});
}

}  // namespace raylign::detail

#include "core/registration/level/run.h"

#include <algorithm>

namespace raylign::detail {

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

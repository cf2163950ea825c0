#pragma once

#include <functional>
#include <span>

#include "raylign/backend.h"
#include "raylign/options.h"
#include "raylign/result.h"
#include "raylign/stop.h"

namespace raylign {

/// How far a run has come.
struct RegistrationProgress {
    int level = 0, levels = 1;
    int iteration = 0;
    double cost = 0;
    double fraction = 0;     ///< of the whole run, estimated, in [0, 1]
    double remaining_s = 0;  ///< estimated
};

/// How a run is watched and stopped. A run that is stopped returns the best pose until then, as doubtful, with
/// Termination::stopped: nothing that was found is thrown away.
struct RunControl {
    std::function<void(const RegistrationProgress&)>
        on_progress;                  ///< called after each step, in the run's thread; may be empty
    StopToken stop;                   ///< asked before every batch of evaluations
    std::function<void()> meanwhile;  ///< called there, too: for an event loop; may be empty
};

/// Finds world_from_ct at which the DRRs of the volume match the views' images, starting from `start_world_from_ct`.
/// Every view needs an image. Throws Error for a bad scene, options out of range, a search on a backend without
/// derivatives, and a start whose DRR misses a detector.
/// Threads: several runs may go on at once, each with a backend of its own.
[[nodiscard]] RegistrationResult register_volume(const Volume& volume, std::span<const View> views,
                                                 const RigidTransform& start_world_from_ct,
                                                 const RegistrationOptions& options, Backend& backend,
                                                 const RunControl& control = {});

}  // namespace raylign

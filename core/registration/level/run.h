#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/base/clock.h"
#include "core/registration/object/resident_volume.h"
#include "raylign/registration.h"

namespace raylign::detail {

/// Thrown between batches to end a run early; never leaves register_resident, which returns the best so far.
struct RunStopped {
    Termination why;
};

/// Wall time of levels that are open one inside another: at any time it counts for the one opened last, so that the
/// levels' times add up.
class LevelClock {
public:
    void open(int level, Clock::time_point since);
    /// Seconds that counted for this level.
    double close(int level);

private:
    struct Open {
        int level;
        double time_s;
    };
    void count_until(Clock::time_point now);

    std::vector<Open> open_;  ///< the last one's time runs
    Clock::time_point counted_ = Clock::now();
};

/// By how much all views fit best magnified (trust/magnification.h): logarithm, and its standard deviation.
struct Magnification {
    double log = 0, sigma = 0;
};

/// What all parts of one registration share.
struct Run {
    ResidentVolume& resident;
    std::span<const View> views;
    const RegistrationOptions& options;
    const RunControl& control;
    ObjectExtent extent;  ///< of the object, about the rotation centre
    RigidTransform start;
    RegistrationResult result{};
    /// Cost of the finest level before the fine filter and the weights that finish it: noise alone raises those.
    std::optional<double> explained_cost{};
    /// The same per view.
    std::vector<double> explained_view_costs{};
    /// Whether the X-ray shows the CT's cut sides as the CT has them, or more of the body. Nothing where that is not
    /// known yet, as before a place is found.
    std::optional<bool> shows_the_cut{};
    /// What all views would rather be magnified by; nothing where that is not known.
    std::optional<Magnification> magnification{};
    /// Why the images and not the pose must be wrong; a part was not sought then.
    std::optional<std::string> suspicion{};
    /// Nothing fits: what is left to do is done with few iterations.
    bool is_hopeless = false;
    Clock::time_point begin = Clock::now();
    LevelClock level_clock;
    double total_work = 1, done_work = 0;  ///< in units of level_work
    int level_count = 1;                   ///< planned so far

    [[nodiscard]] const Volume& volume() const { return resident.volume(); }
    [[nodiscard]] bool has_derivatives() const { return resident.backend().info().has_derivatives; }
    [[nodiscard]] double elapsed_s() const { return seconds_since(begin); }
};

/// sum += more.
void add(SessionTiming& sum, const SessionTiming& more);
void add(SessionCounters& sum, const SessionCounters& more);

/// Before every batch. Throws RunStopped where the caller asks for it or the time is over.
void stop_if_asked(const Run& run);

/// Tells the caller how far the run is: `work` units beyond what is done.
void show_progress(const Run& run, int level, double work, double cost, int iteration = 0);

}  // namespace raylign::detail

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/track/inputs.h"
#include "core/tracking/smoothing.h"
#include "raylign/io/trajectory.h"

namespace raylign::detail::apps {

/// What --smooth says: none, auto (no strength) or a strength.
struct SmoothWish {
    bool is_wanted = false;
    std::optional<double> strength;
};
/// Throws Error for what is neither none, auto nor a strength in (0, 1e9].
[[nodiscard]] SmoothWish parse_smooth(const std::string& text);

/// The jitter of each object.
[[nodiscard]] std::vector<TrackJitter> jitters_of(const std::vector<TrajectoryRow>& rows, const TrackInputs& inputs);

/// The rows with the poses that smoothing makes of them, weighted by their expected errors; a frame without one is as
/// sure as the median. Adds to `notes` how strongly it was smoothed.
[[nodiscard]] std::vector<TrajectoryRow> smoothed_rows(std::vector<TrajectoryRow> rows, const TrackInputs& inputs,
                                                       const SmoothWish& wish, std::vector<std::string>& notes);

}  // namespace raylign::detail::apps

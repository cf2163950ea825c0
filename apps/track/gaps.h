#pragma once

#include <string>
#include <vector>

#include "apps/track/inputs.h"
#include "raylign/io/trajectory.h"

namespace raylign::detail::apps {

/// The rows of one view with depths that --joint-gap holds (core/tracking/depth_gap.h): of the pairs that --joint
/// names, else of each object and the next one. A depth is that of the object's centre along the view's axis, and the
/// object moves along its line of sight, so that its place in the image stays. Only frames that are ok take part. Adds
/// to `notes` how far depths were moved.
[[nodiscard]] std::vector<TrajectoryRow> rows_with_gaps_held(std::vector<TrajectoryRow> rows, const TrackInputs& inputs,
                                                             double gap_mm, std::vector<std::string>& notes);

}  // namespace raylign::detail::apps

#pragma once

#include <filesystem>
#include <vector>

#include "apps/track/report.h"

namespace raylign::detail::apps {

/// X-ray under DRR for the page: the first, the middle and the last frame of each object that have a pose, the one
/// whose cost is largest, and some of those in doubt; every view. `scratch`: a folder where a file may stand for a
/// moment.
[[nodiscard]] std::vector<PageOverlay> track_pictures(const TrackReport& report, Backend& backend,
                                                      const std::filesystem::path& scratch);

}  // namespace raylign::detail::apps

#pragma once

#include <CLI/CLI.hpp>

#include "apps/report_page/page_script.h"
#include "apps/track/report.h"
#include "apps/viewer/viewer_page.h"

namespace raylign::detail::apps {

/// The viewer of track.html: frames with a slider, and the objects as found. What is moved there becomes a key frame.
/// Empty where it is not wanted, and where this build has none.
[[nodiscard]] PageScript track_viewer(const TrackReport& report);

/// This command again, with its key frames apart: the page may replace them.
[[nodiscard]] GoOn track_again(const CLI::App& command, const TrackCommandOptions& options);

}  // namespace raylign::detail::apps

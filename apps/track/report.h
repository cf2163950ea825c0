#pragma once

#include <string>
#include <vector>

#include "apps/report_page/report_page.h"
#include "apps/shared/invocation.h"
#include "apps/track/joint_table.h"
#include "apps/track/run.h"
#include "core/tracking/smoothing.h"
#include "raylign/backends.h"

namespace raylign::detail::apps {

/// One run of `track`, as report and summary tell it.
struct TrackReport {
    const TrackCommandOptions& options;
    const Invocation& invocation;
    const TrackInputs& inputs;
    const TrackRecord& record;
    BackendInfo backend;
    std::vector<BackendStatus> passed_over;
    std::vector<TrackJitter> jitters;           ///< one per object
    std::vector<std::vector<JointRow>> joints;  ///< one table per joint
    InputHashes hashed;                         ///< what was read, and the lists of the frames' hashes
    std::vector<std::string> notes;             ///< of reading, and of what was left out
    std::vector<std::string> outputs;           ///< file names in the output folder
    double total_s = 0;

    [[nodiscard]] std::string joint_name(std::size_t joint) const;  ///< "femur_tibia"
    [[nodiscard]] bool complete() const { return !record.stopped_by; }
    /// Every frame was done and is ok.
    [[nodiscard]] bool ok() const;
};

/// track.json, indented, with a final newline.
[[nodiscard]] std::string track_json(const TrackReport& report);

/// What `track` tells on stdout.
[[nodiscard]] std::string track_summary(const TrackReport& report);

}  // namespace raylign::detail::apps

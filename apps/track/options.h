#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/shared/flags.h"
#include "apps/viewer/viewer_page.h"
#include "raylign/io/frames.h"
#include "raylign/joint_motion.h"
#include "raylign/tracking.h"

namespace raylign::detail::apps {

/// What the command line of `track` says.
struct TrackCommandOptions {
    VolumeFlags volume;
    ViewFlags views;
    MethodFlags method;
    SearchFlags search;
    BackendFlags backend;
    OutputFlags output;
    std::vector<std::string> frames;  ///< VIEW=PATTERN
    FrameRange range;
    std::vector<std::string> bones;       ///< NAME=FILE or NAME=LABELS; none = one object called "object"
    std::vector<std::string> starts;      ///< FILE or NAME=FILE
    std::vector<std::string> key_frames;  ///< N=FILE or NAME:N=FILE
    std::string recover = "global";
    double max_jump_mm = 0;
    bool is_thorough = false;         ///< every frame in full
    double depth_change_mm = 0;       ///< 0 = unknown
    double joint_gap_mm = 0;          ///< 0 = unknown
    bool is_alone = false;            ///< each object as if the others were not there
    std::string smooth = "none";      ///< none, auto or a strength
    std::vector<std::string> joints;  ///< PROXIMAL,DISTAL
    std::string cardan = "XYZ";
    std::vector<std::string> axes;  ///< NAME=FILE
    bool no_viewer = false;
    GoOn go_on;  ///< this command again, with other key frames
};

/// One object as the flags say it.
struct ObjectFlags {
    std::string name;
    VolumeFlags volume;
    std::string start;                      ///< file, "dicom", or "" = none
    std::map<int, std::string> key_frames;  ///< files by frame
    std::string axes;                       ///< file, or "" = none
    /// Of the volume, as an Autoscoper trial says it: columns, rows, pages that it shows reversed.
    std::array<bool, 3> flips = {false, false, false};
};

/// The objects in the order of the command line; where it names none, the volumes of an Autoscoper trial among the
/// views, called like their files. Throws Error for names that are none, stand twice or are unknown, and for flags that
/// contradict each other; no file but a trial is read.
[[nodiscard]] std::vector<ObjectFlags> objects_of(const TrackCommandOptions& options);

/// Throws Error for a --joint-gap out of range, and where there is one object.
void check_joint_gap(const TrackCommandOptions& options, std::size_t object_count);

/// Pairs of positions among `objects`. Throws Error for unknown and equal names.
[[nodiscard]] std::vector<std::pair<std::size_t, std::size_t>> joints_of(const TrackCommandOptions& options,
                                                                         const std::vector<ObjectFlags>& objects);

/// The library's own options. `frame_step`: numbers between two frames.
[[nodiscard]] TrackOptions track_options(const TrackCommandOptions& options, double frame_step);

}  // namespace raylign::detail::apps

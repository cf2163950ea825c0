#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "apps/shared/manifest.h"
#include "apps/track/options.h"
#include "raylign/volume.h"

namespace raylign::detail::apps {

struct TrackObject {
    std::string name;
    Volume volume;
    VoxelGrid file_grid;  ///< of the whole file: what Autoscoper's frame is counted from
    /// Where it is tracked from, by number of the frame.
    struct Key {
        RigidTransform world_from_ct;
        bool is_correction = false;  ///< given for this frame, rather than the start of the first
    };
    std::map<int, Key> keys;
    RigidTransform ct_from_axes;  ///< anatomical axes: given, or parallel to ct through the object's centre
};

/// Everything that `track` reads before the first frame.
struct TrackInputs {
    std::vector<TrackObject> objects;
    std::vector<std::pair<std::size_t, std::size_t>> joints;  ///< proximal, distal: positions in objects
    ViewsFile views;                                          ///< with lists of frames, without images
    std::vector<FrameSet> frames;
    std::string saturation;    ///< as --saturation says it
    bool has_metal = false;    ///< one of the objects is a model of metal
    double frame_step = 1;     ///< usual distance of two numbers
    bool is_together = false;  ///< the objects are explained together; else each as if the others were not there
    std::vector<std::string> notes;
    std::vector<std::filesystem::path> files;  ///< every file read, without the frames
    InputHashes hashes;                        ///< of them
    double load_s = 0;

    [[nodiscard]] std::vector<std::string> view_names() const;
};

/// Reads the files that the options name, the small ones first. Throws Error for frames of the wrong size, too.
[[nodiscard]] TrackInputs read_track_inputs(const TrackCommandOptions& options);

/// {"raylign": 1, "ct_from_axes": [[4x4, mm]]}: where anatomical axes lie in the CT.
[[nodiscard]] RigidTransform read_axes(const std::filesystem::path& path);

}  // namespace raylign::detail::apps

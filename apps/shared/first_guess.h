#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/shared/flags.h"
#include "raylign/io/views.h"
#include "raylign/rigid_transform.h"
#include "raylign/volume.h"

namespace raylign::detail::apps {

/// Where a start comes from, and the files that were read for it.
struct FirstGuess {
    RigidTransform world_from_ct;
    std::vector<std::string> notes;
    std::vector<std::filesystem::path> files;
};

/// Which pose of a file with several (.tra, .jts, trajectory.csv, XMALab's CSV) is the start.
struct StartFrame {
    int number = 0;            ///< of the frame, in files that number them; 0 = the only pose of the file
    int line = 0;              ///< of the others, from 1; 0 = the only pose of the file
    std::string object;        ///< in files with several
    VoxelGrid shown_grid;      ///< of the volume file, for .tra
    std::filesystem::path ct;  ///< a file of the volume: the direction of a pose in DICOM; "" = by convention
};

/// The pose file, the pose by landmarks (core/start/landmark_pose.h), the one that DICOM geometry tells (the
/// CT's axes along the world's; its centre where the central rays meet, or the plan's isocentre in the world's origin),
/// or without flags default_start.
[[nodiscard]] FirstGuess first_guess(const StartFlags& flags, const VoxelGrid& grid, const ViewsFile& views,
                                     const StartFrame& frame = {});

}  // namespace raylign::detail::apps

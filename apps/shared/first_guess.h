#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "raylign/io/views.h"
#include "raylign/rigid_transform.h"
#include "raylign/volume.h"

namespace raylign::detail::apps {

/// What the command line says of the start.
struct StartWishes {
    std::filesystem::path start;         ///< pose file, "dicom", or "" = none
    std::filesystem::path landmarks3d;   ///< "" = none
    std::vector<std::string> landmarks;  ///< VIEW=FILE
};

/// Where a start comes from, and the files that were read for it.
struct FirstGuess {
    RigidTransform world_from_ct;
    std::vector<std::string> notes;
    std::vector<std::filesystem::path> files;
};

/// Throws Error for wishes that contradict each other; before any file is read.
void check_wishes(const StartWishes& wishes);

/// The pose file, the pose by landmarks (core/start/landmark_pose.h), the one that DICOM geometry tells (the
/// CT's axes along the world's; its centre where the central rays meet, or the plan's isocentre in the world's origin),
/// or without a wish default_start.
[[nodiscard]] FirstGuess first_guess(const StartWishes& wishes, const VoxelGrid& grid, const ViewsFile& views);

}  // namespace raylign::detail::apps

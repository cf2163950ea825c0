#pragma once

#include <array>
#include <string>

#include "raylign/rigid_transform.h"

namespace raylign::detail::bench {

inline constexpr std::array<const char*, 2> kBones{"left", "right"};

struct GaitSettings {
    std::string folder, file;
    int first = 1, frames = 30, voxels = 256, pixels = 512;
    bool is_joined = false, is_thorough = false, is_together = false;
    double gap_mm = 0;
};

/// Flexion and what goes with it: up to 25 degrees and 10 mm, smooth, at most 1.6 degrees and 0.7 mm from frame to
/// frame. `is_joined`: both are shifted alike, as bones of a joint are, but for a millimetre.
[[nodiscard]] RigidTransform gait_pose(int frame, std::size_t bone, const Eigen::Vector3d& centre_ct_mm,
                                       bool is_joined);

/// Leaves the sequence in the folder: see gait.cpp.
void make_gait(const GaitSettings& settings);

}  // namespace raylign::detail::bench

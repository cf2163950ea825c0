#pragma once

#include <cstdint>
#include <vector>

#include "raylign/view.h"
#include "raylign/volume.h"

namespace raylign::detail::apps {

inline constexpr int kLargestVolumeSide = 160;
inline constexpr int kLargestImageSide_px = 512;

/// A volume as a page carries it: in 8 bit, cropped to what is not air, halved until no side is longer than it may
/// be. Voxel of value n: n / 255 * white_per_mm.
struct EmbeddedVolume {
    VoxelGrid grid;
    std::vector<std::uint8_t> values;  ///< x fastest
    double white_per_mm = 0;           ///< attenuation of 255
    int halvings = 0;
    double clipped_share = 0;                                ///< of the voxels that are not 0: brighter than white
    Eigen::Vector3d centre_ct_mm = Eigen::Vector3d::Zero();  ///< centroid of the attenuation
    double radius_mm = 0;  ///< root mean square distance from it, weighted by the attenuation
};

/// White is the largest attenuation, or twice that of the 10000th part of the densest voxels where that is less: a
/// little metal does not take the grey values of bone. Negative attenuation becomes 0. Throws Error where nothing
/// is positive.
[[nodiscard]] EmbeddedVolume embedded(const Volume& volume, int longest_side = kLargestVolumeSide);

/// A view, halved until no side is longer than it may be.
struct EmbeddedView {
    View view;
    int halvings = 0;
};
[[nodiscard]] EmbeddedView embedded(const View& view, int longest_side_px = kLargestImageSide_px);

}  // namespace raylign::detail::apps

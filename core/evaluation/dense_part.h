#pragma once

#include "raylign/volume.h"

namespace raylign::detail {

/// Where the object's dense part begins [1/mm]: the attenuation of 200 HU (cancellous bone) in the default preset where
/// at least 1000 voxels lie above it, else half of the 99.9th percentile of the positive voxels (a few odd voxels, such
/// as metal or noise, then decide nothing; a homogeneous object counts whole). Throws Error where no voxel is positive.
[[nodiscard]] double dense_threshold_per_mm(const Volume& volume);

}  // namespace raylign::detail

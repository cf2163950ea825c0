#pragma once

#include <filesystem>

#include "core/io/images/stored_pixels.h"

namespace raylign::detail {

/// Reads the header of a NIfTI-1 or NIfTI-2 file. The sform says where the voxels lie where its code is positive (as in
/// nibabel, FSL and TotalSegmentator), else the qform; notes say what was decided. Throws Error for numbers that are
/// not finite, for colours and complex numbers, and for anything damaged.
[[nodiscard]] HeaderedRaster read_nifti(const std::filesystem::path& path);

}  // namespace raylign::detail

#pragma once

#include <filesystem>

namespace raylign::detail {

/// Looks in a NIfTI-1 file's own bytes for what ITK's reader mends silently: zero or negative spacing (it takes the
/// magnitude, or 1), a sheared sform (it falls back to the qform), NaN and Inf voxels and missing data (they become 0).
/// Throws Error for these, and for files that are not NIfTI-1 (ITK also takes Analyze, which does not say where the
/// volume lies).
void check_nifti(const std::filesystem::path& path);

}  // namespace raylign::detail

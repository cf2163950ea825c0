#pragma once

#include <string>
#include <vector>

#include "core/io/dicom/dicom_series.h"
#include "raylign/grid.h"

namespace raylign::detail {

/// Sorts the slices along their normal and returns their lattice. Throws Error for slices that differ in size, storage
/// or orientation, stand at one place, are missing (a gap), or are stacked askew (gantry tilt).
[[nodiscard]] VoxelGrid stack_slices(DicomSeries& series);

/// Throws Error where the slices are no CT, or their values no HU; says what was taken for granted otherwise.
[[nodiscard]] std::vector<std::string> check_values(const DicomSeries& series);

}  // namespace raylign::detail

#pragma once

#include <string>
#include <vector>

#include "core/io/dicom/dicom_series.h"
#include "core/io/images/raster.h"
#include "raylign/grid.h"

namespace raylign::detail {

/// Sorts the slices along their normal and returns their lattice. Throws Error for slices that differ in size, storage
/// or orientation, are one only, stand at one place, are missing (a gap), or are stacked askew (gantry tilt).
[[nodiscard]] VoxelGrid stack_slices(DicomSeries& series);

/// A file of several frames, as of a label map, sorted as those of a CT are; of any kind of image.
[[nodiscard]] Raster read_dicom_stack(const std::filesystem::path& path);

/// Throws Error where the slices are no CT, or their values no HU; says what was taken for granted otherwise.
[[nodiscard]] std::vector<std::string> check_values(const DicomSeries& series);

}  // namespace raylign::detail

#pragma once

#include <filesystem>
#include <functional>

#include "core/io/images/raster.h"

namespace raylign::detail {

/// Reads a DICOM image into values: the modality's table or slope and intercept applied frame by frame, in the order of
/// the file. Its third axis is frames; what a volume's frames need of their place is in dicom_series.h. `check` sees
/// everything but the pixels first and may throw. Throws Error for anything unreadable.
[[nodiscard]] Raster read_dicom(const std::filesystem::path& path, const std::function<void(const Raster&)>& check);

}  // namespace raylign::detail

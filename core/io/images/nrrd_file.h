#pragma once

#include <filesystem>

#include "core/io/images/stored_pixels.h"

namespace raylign::detail {

/// Reads the header of an NRRD (.nrrd, .nhdr). An axis of vectors or colours before all others becomes the components
/// of a pixel. Throws Error for fields that are missing or out of range, for bzip2, and for files that it names that
/// are missing, too short, too few or too many.
[[nodiscard]] HeaderedRaster read_nrrd(const std::filesystem::path& path);

}  // namespace raylign::detail

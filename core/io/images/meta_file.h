#pragma once

#include <filesystem>

#include "core/io/images/stored_pixels.h"

namespace raylign::detail {

/// Reads the header of a MetaImage (.mha, .mhd). Throws Error for keys that are missing or out of range, and for files
/// that it names that are missing, too short, too few or too many.
[[nodiscard]] HeaderedRaster read_meta(const std::filesystem::path& path);

}  // namespace raylign::detail

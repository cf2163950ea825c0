#pragma once

#include <filesystem>
#include <functional>

#include "core/io/images/raster.h"

namespace raylign::detail {

/// TIFF through libtiff: ITK's reader copies pages of differing size into one buffer unchecked and keeps WhiteIsZero to
/// itself. Pages of equal size and type become a third dimension. Spacing is 1: resolution tags rarely mean anything
/// here.
[[nodiscard]] Raster read_tiff(const std::filesystem::path& path, const std::function<void(const Raster&)>& check);

/// Writes one page per plane, uncompressed.
void write_tiff(const std::filesystem::path& path, const Raster& raster);

}  // namespace raylign::detail

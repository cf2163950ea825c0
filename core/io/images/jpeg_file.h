#pragma once

#include <filesystem>
#include <functional>

#include "core/io/images/raster.h"

namespace raylign::detail {

/// JPEG of 8 bits through libjpeg: grey, or colours that are grey within what the compression loses. Throws Error for
/// real colours, CMYK, other depths, and for a file that is damaged or cut off (libjpeg fills up with grey).
[[nodiscard]] Raster read_jpeg(const std::filesystem::path& path, const std::function<void(const Raster&)>& check);

}  // namespace raylign::detail

#pragma once

#include <filesystem>
#include <functional>

#include "core/io/images/raster.h"

namespace raylign::detail {

/// PNG through libpng itself: ITK's reader leaves libpng's faults to abort(). Any depth and interlacing; fewer than 8
/// bits are spread to 8, and colours whose samples agree are grey. `check` sees the header as grey, and again a raster
/// that turned out to have colours or transparency (3, 2 or 4 components).
[[nodiscard]] Raster read_png(const std::filesystem::path& path, const std::function<void(const Raster&)>& check);

}  // namespace raylign::detail

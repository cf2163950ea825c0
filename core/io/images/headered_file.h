#pragma once

#include <filesystem>
#include <functional>

#include "core/io/images/raster.h"

namespace raylign::detail {

/// NIfTI, MetaImage and NRRD, whose headers and pixels are read here: ITK's readers of them pass over units, scaling,
/// missing slices and contradictions in silence, differ from version to version, and end the program for some files.
/// As read_raster.
[[nodiscard]] Raster read_headered(const std::filesystem::path& path, FileFormat format,
                                   const std::function<void(const Raster&)>& check);

}  // namespace raylign::detail

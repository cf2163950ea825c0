#pragma once

#include <filesystem>

#include "raylign/image.h"

namespace raylign::detail {

/// Writes whole numbers as an integer TIFF, to a temporary name first: 8 bits where `largest` fits, else 16. Throws
/// Error for a pixel that is not a whole number in [0, largest], and where the file cannot be written.
void write_counts(const std::filesystem::path& path, const Image& counts, double largest);

}  // namespace raylign::detail

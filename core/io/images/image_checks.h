#pragma once

#include <filesystem>
#include <string>

#include "core/io/images/raster.h"

namespace raylign::detail {

/// Throws Error where the header asks for more bytes of pixels than the file can hold: `stored_bits` per pixel (all
/// samples), unpacked from `packed_bytes` by a compression that makes at best 1 of `best_ratio`. To be called before
/// memory is taken: a damaged header may state any size.
void check_claim(const Raster& header, double stored_bits, double packed_bytes, double best_ratio,
                 const std::filesystem::path& path);

/// Throws Error for a side above 65536 pixels (a slip of the pen, or damage) and for an empty one.
void check_sides(double width, double height, const std::filesystem::path& path);

/// Makes grey of 2 (grey, alpha), 3 (RGB) or 4 (RGBA) samples of 8 or 16 bits where the colours of each pixel are equal
/// and none is transparent, and notes that. Leaves all others as they are.
void reduce_to_grey(Raster& raster);

/// Of TIFF's and Exif's tag Orientation (1 = rows downwards, columns to the right), which is not applied; "" for 1.
[[nodiscard]] std::string orientation_note(int orientation);

}  // namespace raylign::detail

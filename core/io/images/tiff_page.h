#pragma once

#include <tiffio.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "core/io/images/raster.h"

namespace raylign::detail {

/// What must be the same on every page of a TIFF.
struct TiffPage {
    std::uint32_t width = 0, height = 0;
    std::uint16_t bits = 1, samples = 1, sample_format = SAMPLEFORMAT_UINT, photometric = PHOTOMETRIC_MINISBLACK;
    std::uint16_t planar = PLANARCONFIG_CONTIG;
    bool operator==(const TiffPage&) const = default;
};

/// Of the directory that is open.
[[nodiscard]] TiffPage tiff_page_of(TIFF* file);

/// Integers of up to 16 bits become u8 or u16, whatever their number of bits. Throws Error for what is not read: colour
/// models other than grey and RGB, samples in planes of their own, other numbers of bits.
[[nodiscard]] PixelType tiff_pixel_type(const TiffPage& page, const std::filesystem::path& path);

/// Bytes of a pixel in memory, all samples; of a row of `columns` pixels as libtiff hands it out (packed bits).
[[nodiscard]] std::size_t tiff_pixel_bytes(const TiffPage& page);
[[nodiscard]] std::size_t tiff_row_bytes(const TiffPage& page, std::size_t columns);

/// Writes the first `columns` pixels of a row in their type in memory.
void unpack_tiff_row(const TiffPage& page, const std::byte* packed, std::size_t columns, std::byte* out);

/// What the open directory asks for.
struct TiffClaim {
    double decoded_bytes = 0;
    double best_ratio = 1;  ///< of decoded to stored bytes that its compression can reach
};

/// Throws Error where strips or tiles lie beyond the end of the file, or cannot hold the pixels that they state.
[[nodiscard]] TiffClaim tiff_claim_of(TIFF* file, const TiffPage& page, const std::string& where);

}  // namespace raylign::detail

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/io/images/raster.h"

namespace raylign::detail {

/// A file that holds a share of the pixels.
struct PixelPart {
    std::filesystem::path file;
    std::uint64_t begin = 0;  ///< bytes of the file before
    std::uint64_t skip = 0;   ///< bytes before, once unpacked
};

enum class PixelEncoding { raw, deflate, text, hex };

/// How a file whose header is read here (NIfTI, MetaImage, NRRD) keeps its pixels.
struct StoredPixels {
    std::vector<PixelPart> parts;  ///< equal shares, in order
    PixelEncoding encoding = PixelEncoding::raw;
    bool is_big_endian = false;
    double slope = 1, intercept = 0;  ///< value = slope * stored + intercept
};

/// A file's header: all of a Raster but its pixels, and where these are.
struct HeaderedRaster {
    Raster raster;  ///< its type is that of the stored pixels
    StoredPixels stored;
};

/// Bytes that the header states, as a float: a damaged one may state more than an integer holds.
[[nodiscard]] double stated_bytes(const Raster& raster);

/// Throws Error where the files cannot hold what the header states. Nothing as large as the pixels is allocated.
/// `where`: the header's file.
void check_stored(const HeaderedRaster& header, const std::filesystem::path& where);

/// Reads the pixels into header.raster: in the machine's byte order, scaled ones as floats. Throws Error for damage.
void read_stored(HeaderedRaster& header, const std::filesystem::path& where);

/// For what cannot be told from damage: "<where> cannot be read as NIfTI (truncated, damaged or another format?): ...".
[[nodiscard]] Error damaged(const std::filesystem::path& where, FileFormat format, const std::string& reason);

}  // namespace raylign::detail

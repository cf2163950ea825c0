#include "core/io/images/tiff_page.h"

#include <algorithm>
#include <cstring>

#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

bool is_packed(const TiffPage& page) { return page.bits < 16 && page.bits != 8; }

void check_colours(const TiffPage& page, const std::filesystem::path& path) {
    const auto refuse = [&](const std::string& what) { throw bad_value("TIFF colours", what, "grey", path.string()); };
    switch (page.photometric) {
        case PHOTOMETRIC_MINISWHITE:
        case PHOTOMETRIC_MINISBLACK:
        case PHOTOMETRIC_RGB:
        case PHOTOMETRIC_MASK:
            break;
        case PHOTOMETRIC_PALETTE:
            refuse("a palette");
            break;
        case PHOTOMETRIC_YCBCR:
            break;
        case PHOTOMETRIC_SEPARATED:
            refuse("inks (CMYK)");
            break;
        default:
            refuse("photometric interpretation " + std::to_string(page.photometric));
    }
    if (page.samples > 1 && page.planar != PLANARCONFIG_CONTIG) {
        throw bad_value("TIFF layout", "a plane per sample", "grey, or samples side by side", path.string());
    }
}

double best_ratio_of(TIFF* file, const TiffPage& page) {
    std::uint16_t compression = COMPRESSION_NONE;
    TIFFGetFieldDefaulted(file, TIFFTAG_COMPRESSION, &compression);
    switch (compression) {
        case COMPRESSION_NONE:
            return 1;
        case COMPRESSION_PACKBITS:
            return 64;  // two bytes for 128
        case COMPRESSION_LZW:
            return 4096;  // a code of 12 bits for a string as long as the table
        case COMPRESSION_DEFLATE:
        case COMPRESSION_ADOBE_DEFLATE:
            return 1032;  // two bits for 258 bytes
        case COMPRESSION_JPEG:
        case COMPRESSION_OJPEG:
            return 512;  // a bit for 64 samples
        case COMPRESSION_CCITTRLE:
        case COMPRESSION_CCITTRLEW:
        case COMPRESSION_CCITTFAX3:
        case COMPRESSION_CCITTFAX4:
            return page.width;  // a bit for a row like the last one
        default:
            return 1e5;  // Zstandard's and LZMA's runs
    }
}

}  // namespace

TiffPage tiff_page_of(TIFF* file) {
    TiffPage page;
    TIFFGetField(file, TIFFTAG_IMAGEWIDTH, &page.width);
    TIFFGetField(file, TIFFTAG_IMAGELENGTH, &page.height);
    TIFFGetFieldDefaulted(file, TIFFTAG_BITSPERSAMPLE, &page.bits);
    TIFFGetFieldDefaulted(file, TIFFTAG_SAMPLESPERPIXEL, &page.samples);
    TIFFGetFieldDefaulted(file, TIFFTAG_SAMPLEFORMAT, &page.sample_format);
    TIFFGetField(file, TIFFTAG_PHOTOMETRIC, &page.photometric);
    TIFFGetFieldDefaulted(file, TIFFTAG_PLANARCONFIG, &page.planar);
    if (page.samples == 1) page.planar = PLANARCONFIG_CONTIG;
    if (page.sample_format == SAMPLEFORMAT_VOID) page.sample_format = SAMPLEFORMAT_UINT;
    return page;
}

PixelType tiff_pixel_type(const TiffPage& page, const std::filesystem::path& path) {
    check_colours(page, path);
    const bool is_signed = page.sample_format == SAMPLEFORMAT_INT;
    if (page.sample_format == SAMPLEFORMAT_IEEEFP && page.bits == 32) return PixelType::f32;
    if (page.sample_format == SAMPLEFORMAT_IEEEFP && page.bits == 64) return PixelType::f64;
    if (page.sample_format == SAMPLEFORMAT_UINT || is_signed) {
        if (page.bits == 8) return is_signed ? PixelType::i8 : PixelType::u8;
        if (page.bits == 16) return is_signed ? PixelType::i16 : PixelType::u16;
        if (page.bits == 32) return is_signed ? PixelType::i32 : PixelType::u32;
        if (!is_signed && page.bits >= 1 && page.bits < 16) return page.bits < 8 ? PixelType::u8 : PixelType::u16;
    }
    throw bad_value("TIFF pixel type",
                    std::to_string(page.bits) + " bits, sample format " + std::to_string(page.sample_format),
                    "integers of 1 to 16 or 32 bits or floats of 32 or 64 bits", path.string());
}

std::size_t tiff_pixel_bytes(const TiffPage& page) {
    const std::size_t sample_bytes = page.bits <= 8 ? 1 : page.bits <= 16 ? 2 : page.bits / 8U;
    return sample_bytes * page.samples;
}

std::size_t tiff_row_bytes(const TiffPage& page, std::size_t columns) {
    return (columns * page.samples * page.bits + 7) / 8;
}

void unpack_tiff_row(const TiffPage& page, const std::byte* packed, std::size_t columns, std::byte* out) {
    if (!is_packed(page)) {
        std::memcpy(out, packed, columns * tiff_pixel_bytes(page));
        return;
    }
    unsigned bits = 0, available = 0;  // the largest bit first; a row begins at a byte
    for (std::size_t i = 0; i < columns * page.samples; ++i) {
        for (; available < page.bits; available += 8)
            bits = (bits << 8 | std::to_integer<unsigned>(*packed++)) & 0xFFFFFF;
        available -= page.bits;
        const auto value = static_cast<std::uint16_t>(bits >> available & ((1U << page.bits) - 1));
        if (page.bits < 8) {
            out[i] = static_cast<std::byte>(value);
        } else {
            std::memcpy(out + 2 * i, &value, 2);
        }
    }
}

TiffClaim tiff_claim_of(TIFF* file, const TiffPage& page, const std::string& where) {
    const auto* offsets = static_cast<const std::uint64_t*>(nullptr);
    const auto* counts = static_cast<const std::uint64_t*>(nullptr);
    const bool tiled = TIFFIsTiled(file);
    if (!TIFFGetField(file, tiled ? TIFFTAG_TILEOFFSETS : TIFFTAG_STRIPOFFSETS, &offsets) ||
        !TIFFGetField(file, tiled ? TIFFTAG_TILEBYTECOUNTS : TIFFTAG_STRIPBYTECOUNTS, &counts) || !offsets || !counts) {
        throw Error(where + ": the TIFF does not say where its pixels are");
    }
    const auto file_size = static_cast<std::uint64_t>(TIFFGetSizeProc(file)(TIFFClientdata(file)));
    const std::uint32_t parts = tiled ? TIFFNumberOfTiles(file) : TIFFNumberOfStrips(file);
    double stored_bytes = 0;
    for (std::uint32_t i = 0; i < parts; ++i) {
        if (offsets[i] > file_size || counts[i] > file_size - offsets[i]) {
            throw Error(where + " is truncated: its pixels reach beyond the file's end at byte " +
                        std::to_string(file_size));
        }
        stored_bytes += static_cast<double>(counts[i]);
    }
    TiffClaim claim;
    claim.best_ratio = best_ratio_of(file, page);
    claim.decoded_bytes = static_cast<double>(tiff_row_bytes(page, page.width)) * page.height;
    if (tiled) claim.decoded_bytes = static_cast<double>(TIFFTileSize64(file)) * parts;
    // Strips may lie on top of each other.
    stored_bytes = std::min(stored_bytes, static_cast<double>(file_size));
    if (claim.decoded_bytes <= stored_bytes * claim.best_ratio) return claim;
    throw Error(where + " is damaged or cut off: it states " + std::to_string(page.width) + " x " +
                std::to_string(page.height) + " pixels, " + number_text(claim.decoded_bytes) +
                " bytes, and the file holds " + number_text(stored_bytes) + " bytes of them");
}

}  // namespace raylign::detail

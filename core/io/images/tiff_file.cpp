#include "core/io/images/tiff_file.h"

#include <tiffio.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <memory>
#include <optional>

#include "core/io/files/temporary_file.h"
#include "core/io/files/text.h"
#include "core/io/images/image_checks.h"
#include "core/io/images/quiet_tiff.h"
#include "core/io/images/tiff_page.h"

namespace raylign::detail {
namespace {

using Tiff = std::unique_ptr<TIFF, decltype(&TIFFClose)>;

/// "m" keeps libtiff from mapping the file: one that shrinks meanwhile is then an error, not a bus error.
Tiff open_tiff(const std::filesystem::path& path, const char* mode, const QuietTiff& quiet) {
    Tiff file(TIFFOpen(path.c_str(), mode), &TIFFClose);
    if (!file)
        throw Error(path.string() + " cannot be opened as TIFF (damaged, truncated or another format?)" +
                    quiet.reason());
    return file;
}

/// Goes through the pages, checks that all are like the first, and that the file can hold what they state together.
int count_pages(TIFF* file, const TiffPage& first, const std::filesystem::path& path, const QuietTiff& quiet) {
    const auto file_bytes = static_cast<double>(std::filesystem::file_size(path));
    int pages = 1;
    double decoded_bytes = 0, ratio = 1;
    for (;; ++pages) {
        const std::string where = path.string() + ", page " + std::to_string(pages);
        const TiffPage page = tiff_page_of(file);
        if (pages > 1 && !(page == first))
            throw bad_value("page " + std::to_string(pages), "of another size or pixel type", "like page 1",
                            path.string());
        const TiffClaim claim = tiff_claim_of(file, page, where);
        decoded_bytes += claim.decoded_bytes;
        ratio = std::max(ratio, claim.best_ratio);
        if (decoded_bytes > file_bytes * ratio) {
            throw Error(where + " is damaged or cut off: up to here the pages state " + number_text(decoded_bytes) +
                        " bytes of pixels, and the file has " + number_text(file_bytes));
        }
        if (TIFFLastDirectory(file)) break;
        if (TIFFReadDirectory(file)) continue;
        throw Error(path.string() + ": page " + std::to_string(pages + 1) + " is damaged or cut off" + quiet.reason());
    }
    if (!TIFFSetDirectory(file, 0)) throw Error(path.string() + ": page 1 cannot be read again" + quiet.reason());
    return pages;
}

void read_strips(TIFF* file, const TiffPage& page, std::byte* out) {
    std::uint32_t rows_per_strip = page.height;
    TIFFGetFieldDefaulted(file, TIFFTAG_ROWSPERSTRIP, &rows_per_strip);
    const std::size_t packed_row = tiff_row_bytes(page, page.width), row_bytes = page.width * tiff_pixel_bytes(page);
    if (static_cast<std::size_t>(TIFFScanlineSize(file)) != packed_row || rows_per_strip == 0)
        throw Error("rows of an odd layout");
    std::vector<std::byte> packed;
    for (std::uint32_t row = 0; row < page.height;) {
        const std::uint32_t rows = std::min(rows_per_strip, page.height - row);
        const std::size_t bytes = packed_row * rows;
        std::byte* target = out + row * row_bytes;
        if (packed_row != row_bytes) {
            packed.resize(bytes);
            target = packed.data();
        }
        const auto wanted = static_cast<tmsize_t>(bytes);
        if (TIFFReadEncodedStrip(file, TIFFComputeStrip(file, row, 0), target, wanted) != wanted) {
            throw Error("rows from " + std::to_string(row) + " on are damaged or cut off");
        }
        for (std::uint32_t y = 0; packed_row != row_bytes && y < rows; ++y) {
            unpack_tiff_row(page, packed.data() + y * packed_row, page.width, out + (row + y) * row_bytes);
        }
        row += rows;
    }
}

void read_tiles(TIFF* file, const TiffPage& page, std::byte* out) {
    std::uint32_t tile_width = 0, tile_height = 0;
    TIFFGetField(file, TIFFTAG_TILEWIDTH, &tile_width);
    TIFFGetField(file, TIFFTAG_TILELENGTH, &tile_height);
    const std::size_t tile_row = tiff_row_bytes(page, tile_width), pixel_bytes = tiff_pixel_bytes(page);
    std::vector<std::byte> tile(static_cast<std::size_t>(TIFFTileSize(file)));
    // A size that overflows is 0 to libtiff.
    if (tile.empty() || tile.size() != tile_row * tile_height) throw Error("tiles of an odd layout");
    for (std::uint32_t y = 0; y < page.height; y += tile_height) {
        for (std::uint32_t x = 0; x < page.width; x += tile_width) {
            if (TIFFReadTile(file, tile.data(), x, y, 0, 0) < 0) throw Error("a tile is damaged or cut off");
            const std::uint32_t columns = std::min(tile_width, page.width - x);
            for (std::uint32_t row = 0; row < std::min(tile_height, page.height - y); ++row) {
                unpack_tiff_row(page, tile.data() + row * tile_row, columns,
                                out + ((y + row) * std::size_t{page.width} + x) * pixel_bytes);
            }
        }
    }
}

Raster header_of(TIFF* file, const TiffPage& page, int pages, const std::filesystem::path& path) {
    Raster raster;
    raster.format = FileFormat::tiff;
    raster.size = {static_cast<int>(page.width), static_cast<int>(page.height)};
    if (pages > 1) raster.size.push_back(pages);
    raster.spacing_mm.assign(raster.size.size(), 1);
    raster.origin_mm.assign(raster.size.size(), 0);
    const auto dimensions = static_cast<Eigen::Index>(raster.size.size());
    raster.direction = Eigen::MatrixXd::Identity(dimensions, dimensions);
    raster.type = tiff_pixel_type(page, path);
    raster.components = page.samples;
    raster.white_is_zero = page.photometric == PHOTOMETRIC_MINISWHITE;
    if (page.bits != 8 * bytes_of(raster.type)) raster.bits_stored = page.bits;
    std::uint16_t orientation = ORIENTATION_TOPLEFT, compression = COMPRESSION_NONE;
    TIFFGetFieldDefaulted(file, TIFFTAG_ORIENTATION, &orientation);
    TIFFGetFieldDefaulted(file, TIFFTAG_COMPRESSION, &compression);
    if (const std::string note = orientation_note(orientation); !note.empty()) raster.notes.push_back(note);
    if (compression == COMPRESSION_JPEG) raster.notes.emplace_back("compressed by JPEG, which is lossy");
    return raster;
}

void read_page(TIFF* file, const TiffPage& page, std::byte* out) {
    if (page.photometric == PHOTOMETRIC_YCBCR) {
        std::uint16_t compression = COMPRESSION_NONE;
        TIFFGetFieldDefaulted(file, TIFFTAG_COMPRESSION, &compression);
        if (compression != COMPRESSION_JPEG) throw Error("YCbCr colours are read with JPEG compression only");
        TIFFSetField(file, TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
    }
    if (TIFFIsTiled(file)) return read_tiles(file, page, out);
    read_strips(file, page, out);
}

}  // namespace

Raster read_tiff(const std::filesystem::path& path, const std::function<void(const Raster&)>& check) {
    const QuietTiff quiet;
    const Tiff file = open_tiff(path, "rm", quiet);
    const TiffPage page = tiff_page_of(file.get());
    check_sides(page.width, page.height, path);
    (void)tiff_pixel_type(page, path);
    const int pages = count_pages(file.get(), page, path, quiet);
    Raster raster = header_of(file.get(), page, pages, path);
    const bool may_be_grey = raster.components <= 4 && (raster.type == PixelType::u8 || raster.type == PixelType::u16);
    if (may_be_grey) raster.components = 1;
    if (check) check(raster);
    raster.components = page.samples;
    if (!may_be_grey && raster.components != 1)
        throw bad_value("samples per pixel", std::to_string(page.samples), "1 (grey)", path.string());
    const std::size_t page_bytes = std::size_t{page.width} * page.height * tiff_pixel_bytes(page);
    raster.bytes.resize(page_bytes * static_cast<std::size_t>(pages));
    for (int i = 0; i < pages; ++i) {
        const std::string where = path.string() + ", page " + std::to_string(i + 1) + ": ";
        if (i > 0 && !TIFFReadDirectory(file.get())) throw Error(where + "cannot be read again" + quiet.reason());
        try {
            read_page(file.get(), page, raster.bytes.data() + page_bytes * static_cast<std::size_t>(i));
        } catch (const Error& failure) {
            throw Error(where + failure.what() + quiet.reason());
        }
    }
    reduce_to_grey(raster);
    if (check && raster.components != 1) check(raster);
    return raster;
}

void write_tiff(const std::filesystem::path& path, const Raster& raster) {
    const QuietTiff quiet;
    Tiff file = open_tiff(path, "w", quiet);
    const std::size_t row_bytes = raster.size[0] * bytes_of(raster.type);
    const int pages = raster.size.size() > 2 ? raster.size[2] : 1;
    const std::byte* row = raster.bytes.data();
    for (int page = 0; page < pages; ++page) {
        TIFFSetField(file.get(), TIFFTAG_IMAGEWIDTH, raster.size[0]);
        TIFFSetField(file.get(), TIFFTAG_IMAGELENGTH, raster.size[1]);
        TIFFSetField(file.get(), TIFFTAG_BITSPERSAMPLE, static_cast<int>(8 * bytes_of(raster.type)));
        TIFFSetField(file.get(), TIFFTAG_SAMPLESPERPIXEL, 1);
        TIFFSetField(file.get(), TIFFTAG_SAMPLEFORMAT,
                     is_integer(raster.type) ? SAMPLEFORMAT_UINT : SAMPLEFORMAT_IEEEFP);
        TIFFSetField(file.get(), TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
        TIFFSetField(file.get(), TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
        TIFFSetField(file.get(), TIFFTAG_ROWSPERSTRIP, raster.size[1]);
        for (int y = 0; y < raster.size[1]; ++y, row += row_bytes) {
            // libtiff takes void*, and leaves the row alone where the byte order is the machine's.
            if (TIFFWriteScanline(file.get(), const_cast<std::byte*>(row), y, 0) < 0) {
                throw Error(path.string() + " cannot be written: " + system_reason(errno));
            }
        }
        if (!TIFFWriteDirectory(file.get())) throw Error(path.string() + " cannot be written: " + system_reason(errno));
    }
}

}  // namespace raylign::detail

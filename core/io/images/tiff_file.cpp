#include "core/io/images/tiff_file.h"

#include <tiffio.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <optional>

#include "core/io/files/temporary_file.h"

namespace raylign::detail {
namespace {

/// libtiff's handlers print; they are process-wide until 4.5, so they are silenced for as long as this lives.
struct QuietTiff {
    TIFFErrorHandler warning = TIFFSetWarningHandler(nullptr);
    TIFFErrorHandler error = TIFFSetErrorHandler(nullptr);
    QuietTiff() = default;
    QuietTiff(const QuietTiff&) = delete;
    QuietTiff& operator=(const QuietTiff&) = delete;
    ~QuietTiff() {
        TIFFSetWarningHandler(warning);
        TIFFSetErrorHandler(error);
    }
};

using Tiff = std::unique_ptr<TIFF, decltype(&TIFFClose)>;

Tiff open_tiff(const std::filesystem::path& path, const char* mode) {
    Tiff file(TIFFOpen(path.c_str(), mode), &TIFFClose);
    if (!file) throw Error(path.string() + " cannot be opened as TIFF (damaged, truncated or another format?)");
    return file;
}

/// What must be the same on every page.
struct Page {
    std::uint32_t width = 0, height = 0;
    std::uint16_t bits = 1, samples = 1, sample_format = SAMPLEFORMAT_UINT, photometric = PHOTOMETRIC_MINISBLACK;
    bool operator==(const Page&) const = default;
};

Page page_of(TIFF* file) {
    Page page;
    TIFFGetField(file, TIFFTAG_IMAGEWIDTH, &page.width);
    TIFFGetField(file, TIFFTAG_IMAGELENGTH, &page.height);
    TIFFGetFieldDefaulted(file, TIFFTAG_BITSPERSAMPLE, &page.bits);
    TIFFGetFieldDefaulted(file, TIFFTAG_SAMPLESPERPIXEL, &page.samples);
    TIFFGetFieldDefaulted(file, TIFFTAG_SAMPLEFORMAT, &page.sample_format);
    TIFFGetField(file, TIFFTAG_PHOTOMETRIC, &page.photometric);
    return page;
}

PixelType type_of(const Page& page, const std::filesystem::path& path) {
    const bool is_signed = page.sample_format == SAMPLEFORMAT_INT;
    if (page.sample_format == SAMPLEFORMAT_IEEEFP && page.bits == 32) return PixelType::f32;
    if (page.sample_format == SAMPLEFORMAT_IEEEFP && page.bits == 64) return PixelType::f64;
    if (page.sample_format == SAMPLEFORMAT_UINT || is_signed) {
        if (page.bits == 8) return is_signed ? PixelType::i8 : PixelType::u8;
        if (page.bits == 16) return is_signed ? PixelType::i16 : PixelType::u16;
        if (page.bits == 32) return is_signed ? PixelType::i32 : PixelType::u32;
    }
    throw bad_value("TIFF pixel type",
                    std::to_string(page.bits) + " bits, sample format " + std::to_string(page.sample_format),
                    "integers of 8, 16 or 32 bits or floats of 32 or 64 bits", path.string());
}

void check_page(const Page& page, const std::filesystem::path& path) {
    if (page.photometric == PHOTOMETRIC_PALETTE) {
        throw bad_value("TIFF colours", "a palette", "grey", path.string());
    }
    if (page.width < 1 || page.height < 1 || page.width > (1U << 30) || page.height > (1U << 30)) {
        throw bad_value("TIFF size", std::to_string(page.width) + " x " + std::to_string(page.height), "at least 1 x 1",
                        path.string());
    }
}

int count_pages(TIFF* file, const Page& first, const std::filesystem::path& path) {
    int pages = 1;
    for (; TIFFReadDirectory(file); ++pages) {
        if (page_of(file) == first) continue;
        throw bad_value("page " + std::to_string(pages + 1), "of another size or pixel type", "like page 1",
                        path.string());
    }
    // A directory that does not parse ends the loop just like the last one does.
    if (!TIFFLastDirectory(file))
        throw Error(path.string() + ": page " + std::to_string(pages + 1) + " is damaged or cut off");
    if (!TIFFSetDirectory(file, 0)) throw Error(path.string() + ": page 1 cannot be read again");
    return pages;
}

void read_strips(TIFF* file, std::size_t row_bytes, std::uint32_t height, std::byte* out) {
    std::uint32_t rows_per_strip = height;
    TIFFGetFieldDefaulted(file, TIFFTAG_ROWSPERSTRIP, &rows_per_strip);
    for (std::uint32_t row = 0; row < height;) {
        const std::uint32_t rows = std::min(rows_per_strip, height - row);
        const auto bytes = static_cast<tmsize_t>(row_bytes * rows);
        if (TIFFReadEncodedStrip(file, TIFFComputeStrip(file, row, 0), out + row * row_bytes, bytes) != bytes) {
            throw Error("rows from " + std::to_string(row) + " on are damaged or cut off");
        }
        row += rows;
    }
}

void read_tiles(TIFF* file, const Page& page, std::size_t pixel_bytes, std::byte* out) {
    std::uint32_t tile_width = 0, tile_height = 0;
    TIFFGetField(file, TIFFTAG_TILEWIDTH, &tile_width);
    TIFFGetField(file, TIFFTAG_TILELENGTH, &tile_height);
    std::vector<std::byte> tile(static_cast<std::size_t>(TIFFTileSize(file)));
    // A size that overflows is 0 to libtiff.
    if (tile.empty() || tile.size() != std::size_t{tile_width} * tile_height * pixel_bytes)
        throw Error("tiles of an odd layout");
    for (std::uint32_t y = 0; y < page.height; y += tile_height) {
        for (std::uint32_t x = 0; x < page.width; x += tile_width) {
            if (TIFFReadTile(file, tile.data(), x, y, 0, 0) < 0) throw Error("a tile is damaged or cut off");
            const std::size_t columns = std::min(tile_width, page.width - x);
            for (std::uint32_t row = 0; row < std::min(tile_height, page.height - y); ++row) {
                std::memcpy(out + ((y + row) * std::size_t{page.width} + x) * pixel_bytes,
                            tile.data() + row * std::size_t{tile_width} * pixel_bytes, columns * pixel_bytes);
            }
        }
    }
}

Raster header_of(const Page& page, int pages, const std::filesystem::path& path) {
    Raster raster;
    raster.format = FileFormat::tiff;
    raster.size = {static_cast<int>(page.width), static_cast<int>(page.height)};
    if (pages > 1) raster.size.push_back(pages);
    raster.spacing_mm.assign(raster.size.size(), 1);
    raster.origin_mm.assign(raster.size.size(), 0);
    const auto dimensions = static_cast<Eigen::Index>(raster.size.size());
    raster.direction = Eigen::MatrixXd::Identity(dimensions, dimensions);
    raster.type = type_of(page, path);
    raster.components = page.samples;
    raster.white_is_zero = page.photometric == PHOTOMETRIC_MINISWHITE;
    return raster;
}

/// Throws where the file is shorter than its strips say: a truncated header may ask for any amount of memory.
void check_data_size(TIFF* file, const std::filesystem::path& path) {
    const auto* offsets = static_cast<const std::uint64_t*>(nullptr);
    const auto* counts = static_cast<const std::uint64_t*>(nullptr);
    const bool tiled = TIFFIsTiled(file);
    if (!TIFFGetField(file, tiled ? TIFFTAG_TILEOFFSETS : TIFFTAG_STRIPOFFSETS, &offsets) ||
        !TIFFGetField(file, tiled ? TIFFTAG_TILEBYTECOUNTS : TIFFTAG_STRIPBYTECOUNTS, &counts)) {
        throw Error(path.string() + ": the TIFF does not say where its pixels are");
    }
    const std::uint64_t file_size = std::filesystem::file_size(path);
    const std::uint32_t parts = tiled ? TIFFNumberOfTiles(file) : TIFFNumberOfStrips(file);
    for (std::uint32_t i = 0; i < parts; ++i) {
        if (offsets[i] > file_size || counts[i] > file_size - offsets[i]) {
            throw Error(path.string() + " is truncated: its pixels reach beyond its end at byte " +
                        std::to_string(file_size));
        }
    }
}

}  // namespace

Raster read_tiff(const std::filesystem::path& path, const std::function<void(const Raster&)>& check) {
    const QuietTiff quiet;
    const Tiff file = open_tiff(path, "r");
    const Page page = page_of(file.get());
    check_page(page, path);
    const int pages = count_pages(file.get(), page, path);
    Raster raster = header_of(page, pages, path);
    if (check) check(raster);
    if (raster.components != 1)
        throw bad_value("samples per pixel", std::to_string(page.samples), "1 (grey)", path.string());
    const std::size_t pixel_bytes = bytes_of(raster.type);
    const std::size_t page_bytes = std::size_t{page.width} * page.height * pixel_bytes;
    for (int i = 0; i < pages; ++i) {
        if (i > 0 && !TIFFReadDirectory(file.get())) throw Error(path.string() + ": a page cannot be read again");
        check_data_size(file.get(), path);
        raster.bytes.resize(page_bytes * pages);
        std::byte* out = raster.bytes.data() + page_bytes * i;
        try {
            if (TIFFIsTiled(file.get())) {
                read_tiles(file.get(), page, pixel_bytes, out);
            } else {
                read_strips(file.get(), page.width * pixel_bytes, page.height, out);
            }
        } catch (const Error& failure) {
            throw Error(path.string() + ", page " + std::to_string(i + 1) + ": " + failure.what());
        }
    }
    return raster;
}

void write_tiff(const std::filesystem::path& path, const Raster& raster) {
    const QuietTiff quiet;
    Tiff file = open_tiff(path, "w");
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

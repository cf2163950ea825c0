#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/io/files/file_format.h"
#include "core/io/volumes/label_names.h"

namespace raylign::detail {

enum class PixelType { u8, i8, u16, i16, u32, i32, u64, i64, f32, f64 };
[[nodiscard]] std::string pixel_type_name(PixelType type);
[[nodiscard]] bool is_integer(PixelType type);
[[nodiscard]] std::size_t bytes_of(PixelType type);

/// Pixels of a file in the file's own type, with what the file says of their place (LPS, mm).
struct Raster {
    FileFormat format = FileFormat::meta;
    std::vector<int> size;  ///< as many numbers as the file has dimensions, x first
    std::vector<double> spacing_mm;
    std::vector<double> origin_mm;
    Eigen::MatrixXd direction;  ///< columns: unit axes, not always at right angles
    PixelType type = PixelType::u8;
    int components = 1;              ///< numbers per pixel: 3 for RGB
    bool white_is_zero = false;      ///< TIFF WhiteIsZero, DICOM MONOCHROME1 or INVERSE
    std::string shown_dark_by;       ///< DICOM: the tags that white_is_zero comes from
    int bits_stored = 0;             ///< of integers; 0 where the file does not say
    double largest = 0;              ///< pixel that the detector could give; 0: what bits_stored holds
    std::vector<bool> is_padding;    ///< DICOM: pixels that are no image; empty = none
    std::vector<std::byte> bytes;    ///< x fastest
    std::vector<std::string> notes;  ///< what was decided on reading: units, scaling, which place counts
    std::string no_place;            ///< why a volume cannot lie where its header says; "" = it can
    LabelNames label_names;          ///< of a label map whose file names its labels

    [[nodiscard]] std::size_t pixel_count() const;
};

/// Sets the size and, until the header says more, spacing 1, origin 0 and the axes of the frame.
void set_size(Raster& raster, const std::vector<int>& size);

/// "64 x 64 x 20"
[[nodiscard]] std::string size_text(std::span<const int> size);

/// Reads a file. `check` sees everything but the pixels first and may throw. Throws Error for anything unreadable. The
/// file is decoded in a process of its own (core/io/decode/).
[[nodiscard]] Raster read_raster(const std::filesystem::path& path,
                                 const std::function<void(const Raster&)>& check = {});

/// Everything but the pixels.
[[nodiscard]] Raster read_raster_header(const std::filesystem::path& path);

/// read_raster by this process: for files of our own, and where there is no other process.
[[nodiscard]] Raster read_raster_here(const std::filesystem::path& path,
                                      const std::function<void(const Raster&)>& check = {});

/// Writes to a temporary name, reads back and compares (ITK's writers do not all notice a full disk), then renames.
void write_raster(const std::filesystem::path& path, const Raster& raster);

/// Calls body(pointer to the pixels in their own type) once.
template <typename Body>
decltype(auto) with_pixels(const Raster& raster, Body&& body) {
    const void* data = raster.bytes.data();
    switch (raster.type) {
        case PixelType::u8:
            return body(static_cast<const std::uint8_t*>(data));
        case PixelType::i8:
            return body(static_cast<const std::int8_t*>(data));
        case PixelType::u16:
            return body(static_cast<const std::uint16_t*>(data));
        case PixelType::i16:
            return body(static_cast<const std::int16_t*>(data));
        case PixelType::u32:
            return body(static_cast<const std::uint32_t*>(data));
        case PixelType::i32:
            return body(static_cast<const std::int32_t*>(data));
        case PixelType::u64:
            return body(static_cast<const std::uint64_t*>(data));
        case PixelType::i64:
            return body(static_cast<const std::int64_t*>(data));
        case PixelType::f32:
            return body(static_cast<const float*>(data));
        case PixelType::f64:
            return body(static_cast<const double*>(data));
    }
    throw Error("unknown pixel type");
}

}  // namespace raylign::detail

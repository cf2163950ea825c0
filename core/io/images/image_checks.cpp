#include "core/io/images/image_checks.h"

#include <array>
#include <limits>

#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

/// Colours equal, and nothing seen through: alpha at its largest.
template <typename T>
bool is_grey(const T* pixel, int components) {
    const bool has_alpha = components % 2 == 0;
    if (has_alpha && pixel[components - 1] != std::numeric_limits<T>::max()) return false;
    return components < 3 || (pixel[0] == pixel[1] && pixel[0] == pixel[2]);
}

template <typename T>
bool keep_one_sample(Raster& raster, T* pixels) {
    const std::size_t count = raster.pixel_count(), step = static_cast<std::size_t>(raster.components);
    for (std::size_t i = 0; i < count; ++i) {
        if (!is_grey(pixels + i * step, raster.components)) return false;
    }
    for (std::size_t i = 0; i < count; ++i) pixels[i] = pixels[i * step];
    raster.bytes.resize(count * sizeof(T));
    return true;
}

}  // namespace

void check_claim(const Raster& header, double stored_bits, double packed_bytes, double best_ratio,
                 const std::filesystem::path& path) {
    double needed = stored_bits / 8;
    for (const int n : header.size) needed *= n;
    if (needed <= packed_bytes * best_ratio) return;
    throw Error(path.string() + " is damaged or cut off: its header states " + size_text(header.size) + " pixels, " +
                number_text(needed) + " bytes, and the file holds " + number_text(packed_bytes) + " bytes of them");
}

void check_sides(double width, double height, const std::filesystem::path& path) {
    constexpr double kLargest = 65536;
    if (width >= 1 && height >= 1 && width <= kLargest && height <= kLargest) return;
    throw bad_value("size", number_text(width) + " x " + number_text(height), "in [1, 65536] per side", path.string());
}

void reduce_to_grey(Raster& raster) {
    if (raster.components < 2 || raster.components > 4) return;
    void* data = raster.bytes.data();
    const bool is_done = raster.type == PixelType::u8    ? keep_one_sample(raster, static_cast<std::uint8_t*>(data))
                         : raster.type == PixelType::u16 ? keep_one_sample(raster, static_cast<std::uint16_t*>(data))
                                                         : false;
    if (!is_done) return;
    raster.notes.push_back(std::to_string(raster.components) +
                           " samples a pixel: taken as grey, as they agree and none is transparent");
    raster.components = 1;
}

std::string orientation_note(int orientation) {
    constexpr std::array<const char*, 9> kWords = {
        "",
        "",
        "columns run to the left (\"flip\": \"columns\" turns them)",
        "it is turned by 180 degrees",
        "rows run upwards (\"flip\": \"rows\" turns them)",
        "columns and rows are exchanged",
        "it is turned by 90 degrees",
        "columns and rows are exchanged and reversed",
        "it is turned by 270 degrees",
    };
    if (orientation < 2 || orientation > 8) return {};
    return "the file says Orientation " + std::to_string(orientation) + ": " +
           kWords[static_cast<std::size_t>(orientation)] +
           ". It is not applied: pixels are taken as they are stored, row by row";
}

}  // namespace raylign::detail

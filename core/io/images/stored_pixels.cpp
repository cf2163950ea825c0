#include "core/io/images/stored_pixels.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "core/io/files/byte_source.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

/// The most bytes of pixels that the part can hold.
double part_capacity(const PixelPart& part, const StoredPixels& stored, PixelType type) {
    constexpr double kDeflateLimit = 1100;  // deflate cannot do better than 1032 to 1
    const double left = static_cast<double>(std::filesystem::file_size(part.file)) - static_cast<double>(part.begin);
    const auto skip = static_cast<double>(part.skip);
    switch (stored.encoding) {
        case PixelEncoding::raw:
            return left - skip;
        case PixelEncoding::deflate:
            return left * kDeflateLimit - skip;
        case PixelEncoding::text:  // a digit and a blank
            return (left + 1) / 2 * static_cast<double>(bytes_of(type));
        case PixelEncoding::hex:
            return left / 2;
    }
    return 0;
}

Error short_of(const Raster& raster, const PixelPart& part, const std::string& has, std::size_t parts,
               const std::filesystem::path& where) {
    return Error(where.string() + " is truncated or damaged: its header states " + size_text(raster.size) +
                 " pixels, " + number_text(stated_bytes(raster) / static_cast<double>(parts)) + " bytes" +
                 (parts > 1 ? " in each of " + std::to_string(parts) + " files" : "") + ", and " + part.file.string() +
                 " has " + has);
}

void swap_bytes(std::vector<std::byte>& bytes, std::size_t element) {
    for (std::size_t i = 0; i + element <= bytes.size(); i += element) {
        std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(i),
                     bytes.begin() + static_cast<std::ptrdiff_t>(i + element));
    }
}

std::string text_of_part(const PixelPart& part) {
    std::string text(std::filesystem::file_size(part.file) - part.begin, '\0');
    ByteSource source(part.file, part.begin, Packing::none);
    text.resize(source.read(std::as_writable_bytes(std::span(text))));
    return text;
}

/// Numbers in words into `to`; returns how many there were.
template <typename T>
std::size_t parse_numbers_of(std::string_view text, std::span<std::byte> to, const PixelPart& part) {
    std::size_t count = 0;
    const char* const end = text.data() + text.size();
    for (const char* at = text.data(); count * sizeof(T) < to.size();) {
        while (at != end && std::strchr(" \t\r\n,\f\v", *at) != nullptr) ++at;
        if (at == end) break;
        T value{};
        const auto result = std::from_chars(at, end, value);
        if (result.ec != std::errc()) {
            throw bad_value("number " + std::to_string(count + 1),
                            "\"" + std::string(at, std::min<std::ptrdiff_t>(end - at, 12)) + "\"",
                            "a number of the type that the header states", part.file.string());
        }
        std::memcpy(to.data() + count++ * sizeof(T), &value, sizeof(T));
        at = result.ptr;
    }
    return count * sizeof(T);
}

std::size_t read_text(const PixelPart& part, Raster& raster, std::span<std::byte> to) {
    const std::string text = text_of_part(part);
    return with_pixels(raster, [&](const auto* pixels) {
        return parse_numbers_of<std::remove_cvref_t<decltype(*pixels)>>(text, to, part);
    });
}

std::size_t read_hex(const PixelPart& part, std::span<std::byte> to) {
    std::size_t digits = 0;
    for (const char c : text_of_part(part)) {
        if (digits == 2 * to.size()) break;
        if (std::strchr(" \t\r\n", c) != nullptr) continue;
        int value = 0;
        if (std::from_chars(&c, &c + 1, value, 16).ec != std::errc()) {
            throw Error(part.file.string() + " is damaged: its pixels are not hexadecimal digits");
        }
        to[digits / 2] =
            digits % 2 == 0 ? static_cast<std::byte>(16 * value) : to[digits / 2] | static_cast<std::byte>(value);
        ++digits;
    }
    return digits / 2;
}

std::size_t read_bytes(const PixelPart& part, Packing packing, std::span<std::byte> to) {
    ByteSource source(part.file, part.begin, packing);
    return source.skip(part.skip) ? source.read(to) : 0;
}

template <typename To>
void scale(const StoredPixels& stored, PixelType type, Raster& raster) {
    std::vector<std::byte> scaled(raster.bytes.size() / bytes_of(raster.type) * sizeof(To));
    with_pixels(raster, [&](const auto* pixels) {
        for (std::size_t i = 0; i < scaled.size() / sizeof(To); ++i) {
            const To value = static_cast<To>(static_cast<double>(pixels[i]) * stored.slope + stored.intercept);
            std::memcpy(scaled.data() + i * sizeof(To), &value, sizeof(To));
        }
    });
    raster.bytes = std::move(scaled);
    raster.type = type;
}

}  // namespace

double stated_bytes(const Raster& raster) {
    double bytes = static_cast<double>(bytes_of(raster.type)) * raster.components;
    for (const int n : raster.size) bytes *= n;
    return bytes;
}

void check_stored(const HeaderedRaster& header, const std::filesystem::path& where) {
    constexpr double kLargest = 1e12;
    const StoredPixels& stored = header.stored;
    const double share = stated_bytes(header.raster) / static_cast<double>(stored.parts.size());
    for (const PixelPart& part : stored.parts) {
        try {
            check_readable_file(part.file);
        } catch (const Error& failure) {
            if (part.file == where) throw;
            throw Error(where.string() + " names a file of pixels: " + failure.what());
        }
        if (share <= std::min(kLargest, part_capacity(part, stored, header.raster.type))) continue;
        const double left = static_cast<double>(std::filesystem::file_size(part.file)) -
                            static_cast<double>(part.begin) - static_cast<double>(part.skip);
        throw short_of(header.raster, part, number_text(std::max(0.0, left)), stored.parts.size(), where);
    }
}

void read_stored(HeaderedRaster& header, const std::filesystem::path& where) {
    Raster& raster = header.raster;
    const StoredPixels& stored = header.stored;
    raster.bytes.resize(raster.pixel_count() * static_cast<std::size_t>(raster.components) * bytes_of(raster.type));
    const std::size_t share = raster.bytes.size() / stored.parts.size();
    std::span<std::byte> rest(raster.bytes);
    for (const PixelPart& part : stored.parts) {
        const std::span<std::byte> to = rest.first(share);
        const Packing packing = stored.encoding == PixelEncoding::deflate ? Packing::deflate : Packing::none;
        const std::size_t count = stored.encoding == PixelEncoding::text  ? read_text(part, raster, to)
                                  : stored.encoding == PixelEncoding::hex ? read_hex(part, to)
                                                                          : read_bytes(part, packing, to);
        if (count != share) throw short_of(raster, part, std::to_string(count), stored.parts.size(), where);
        rest = rest.subspan(share);
    }
    const bool is_foreign = stored.is_big_endian != (std::endian::native == std::endian::big);
    if (is_foreign && stored.encoding != PixelEncoding::text) swap_bytes(raster.bytes, bytes_of(raster.type));
    if (stored.slope == 1 && stored.intercept == 0) return;
    if (raster.type == PixelType::f64) {
        scale<double>(stored, PixelType::f64, raster);
    } else {
        scale<float>(stored, PixelType::f32, raster);
    }
}

Error damaged(const std::filesystem::path& where, FileFormat format, const std::string& reason) {
    return Error(where.string() + " cannot be read as " + format_name(format) +
                 " (truncated, damaged or another format?): " + reason);
}

}  // namespace raylign::detail

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/io/decode/decoder.h"
#include "core/io/decode/pack.h"
#include "core/io/files/file_format.h"
#include "core/io/files/text.h"
#include "core/io/images/raster.h"

namespace raylign::detail {
namespace {

struct HeaderOnly {};  // thrown to end a reading: it goes no further than this file

/// Calls visit(member) for each member but the pixels. As many names as Raster has members: a new one that is not
/// visited does not compile.
template <typename AnyRaster, typename Visit>
void visit_header(AnyRaster& raster, Visit visit) {
    auto& [format, size, spacing_mm, origin_mm, direction, type, components, white_is_zero, bits_stored, inverted_sum,
           bytes] = raster;
    visit(format), visit(size), visit(spacing_mm), visit(origin_mm), visit(direction), visit(type);
    visit(components), visit(white_is_zero), visit(bits_stored), visit(inverted_sum);
    (void)bytes;  // by themselves: they are many
}

std::string packed_header(const Raster& raster) {
    // As many names as Raster has members: a new one that is not packed does not compile.
    const auto& [format, size, spacing_mm, origin_mm, direction, type, components, white_is_zero, shown_dark_by,
                 bits_stored, largest, is_padding, bytes, notes, no_place, label_names] = raster;
    Packer packer;
    packer.add(format).add(size).add(spacing_mm).add(origin_mm).add(direction.rows()).add(direction.cols());
    for (Eigen::Index i = 0; i < direction.size(); ++i) packer.add(direction.data()[i]);
    packer.add(type).add(components).add(white_is_zero).add(shown_dark_by).add(bits_stored).add(largest);
    packer.add(notes.size());
    for (const std::string& note : notes) packer.add(note);
    packer.add(no_place).add(label_names.size());
    for (const auto& [number, name] : label_names) packer.add(number).add(name);
    return packer.add(is_padding.size()).add(bytes.size()).bytes();
}

/// How many bytes follow a header, without taking memory for them.
struct Bulk {
    std::size_t padding = 0, pixels = 0;
};

Raster unpacked_header(std::string_view packed, Bulk& bulk) {
    constexpr Eigen::Index kMostAxes = 64;
    Unpacker from(packed);
    Raster raster;
    raster.format = from.number<FileFormat>();
    raster.size = from.list<int>();
    raster.spacing_mm = from.list<double>();
    raster.origin_mm = from.list<double>();
    const auto rows = from.number<Eigen::Index>(), columns = from.number<Eigen::Index>();
    if (rows < 0 || columns < 0 || rows > kMostAxes || columns > kMostAxes) throw Error("a header without sense");
    raster.direction.resize(rows, columns);
    for (Eigen::Index i = 0; i < raster.direction.size(); ++i) raster.direction.data()[i] = from.number<double>();
    raster.type = from.number<PixelType>();
    raster.components = from.number<int>();
    raster.white_is_zero = from.number<bool>();
    raster.shown_dark_by = from.text();
    raster.bits_stored = from.number<int>();
    raster.largest = from.number<double>();
    for (auto count = from.number<std::size_t>(); count > 0; --count) raster.notes.push_back(from.text());
    raster.no_place = from.text();
    for (auto count = from.number<std::size_t>(); count > 0; --count) {
        const auto number = from.number<std::int32_t>();
        raster.label_names[number] = from.text();
    }
    bulk.padding = from.number<std::size_t>();
    bulk.pixels = from.number<std::size_t>();
    return raster;
}

/// Names and notes may be more than fits a message.
void send_header(DecoderReply& reply, const Raster& raster) {
    const std::string packed = packed_header(raster);
    reply.message(Packer().add(packed.size()).bytes());
    reply.bulk(std::as_bytes(std::span(packed)));
}

Raster receive_header(DecodedStream& stream, Bulk& bulk) {
    constexpr std::size_t kMostBytes = std::size_t{1} << 28;
    const std::string size = stream.message();
    const auto count = Unpacker(size).number<std::size_t>();
    if (count > kMostBytes) throw Error("a header without sense");
    std::string packed(count, '\0');
    stream.bulk(std::as_writable_bytes(std::span(packed)));
    return unpacked_header(packed, bulk);
}

/// As many bytes as the decoder has, which is no mere claim of a header.
void take_memory(std::vector<std::byte>& bytes, std::size_t count, const std::filesystem::path& path) {
    try {
        bytes.resize(count);
    } catch (const std::exception&) {
        throw Error(path.string() + ": not enough memory for its pixels, " + number_text(static_cast<double>(count)) +
                    " bytes");
    }
}

void decode_raster(const std::filesystem::path& path, const std::string&, DecoderReply& reply) {
    const Raster raster = read_raster_here(path, [&](const Raster& header) {
        send_header(reply, header);
        reply.wait_for_consent();
    });
    send_header(reply, raster);
    const std::vector<std::uint8_t> padding(raster.is_padding.begin(), raster.is_padding.end());
    reply.bulk(std::as_bytes(std::span(padding)));
    reply.bulk(raster.bytes);
}

void decode_header(const std::filesystem::path& path, const std::string&, DecoderReply& reply) {
    try {
        (void)read_raster_here(path, [&](const Raster& header) {
            send_header(reply, header);
            throw HeaderOnly{};
        });
    } catch (const HeaderOnly&) {
    }
}

}  // namespace

Raster read_raster(const std::filesystem::path& path, const std::function<void(const Raster&)>& check) {
    check_readable_file(path);
    Raster raster;
    const bool is_read = decode({&decode_raster, path, {}, limits_for(path)}, [&](DecodedStream& stream) {
        Bulk bulk;
        const Raster header = receive_header(stream, bulk);
        if (check) check(header);
        stream.consent();
        raster = receive_header(stream, bulk);  // what the pixels told besides
        std::vector<std::byte> padding;
        take_memory(padding, bulk.padding, path);
        stream.bulk(padding);
        raster.is_padding.resize(padding.size());
        std::ranges::transform(padding, raster.is_padding.begin(),
                               [](std::byte pixel) { return pixel != std::byte{0}; });
        take_memory(raster.bytes, bulk.pixels, path);
        stream.bulk(raster.bytes);
    });
    return is_read ? raster : read_raster_here(path, check);
}

Raster read_raster_header(const std::filesystem::path& path) {
    check_readable_file(path);
    Raster raster;
    const bool is_read = decode({&decode_header, path, {}, limits_for(path)}, [&](DecodedStream& stream) {
        Bulk none;
        raster = receive_header(stream, none);
    });
    if (is_read) return raster;
    try {
        (void)read_raster_here(path, [&](const Raster& header) {
            raster = header;
            throw HeaderOnly{};
        });
    } catch (const HeaderOnly&) {
    }
    return raster;
}

}  // namespace raylign::detail

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
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
    auto& [format, size, spacing_mm, origin_mm, direction, type, components, white_is_zero, shown_dark_by, bits_stored,
           largest, is_padding, bytes, notes, no_place, label_names] = raster;
    visit(format), visit(size), visit(spacing_mm), visit(origin_mm), visit(direction), visit(type), visit(components);
    visit(white_is_zero), visit(shown_dark_by), visit(bits_stored), visit(largest), visit(notes), visit(no_place);
    visit(label_names);
    (void)is_padding, (void)bytes;  // by themselves: they are many
}

/// How many bytes follow a header.
struct PixelBytes {
    std::size_t padding = 0, pixels = 0;
};

/// Notes and names of labels may be more than a message holds.
void send_header(DecoderReply& reply, const Raster& raster) {
    Packer packer;
    visit_header(raster, [&](const auto& member) { packer.add(member); });
    packer.add(raster.is_padding.size()).add(raster.bytes.size());
    reply.message(Packer().add(packer.bytes().size()).bytes());
    reply.bulk(std::as_bytes(std::span(packer.bytes())));
}

/// Takes no memory for the pixels.
Raster receive_header(DecodedStream& stream, PixelBytes& counts) {
    constexpr std::size_t kMostBytes = std::size_t{1} << 28;
    const std::string size = stream.message();
    const auto count = Unpacker(size).number<std::size_t>();
    if (count > kMostBytes) throw Error("a header of no sensible size");
    std::string packed(count, '\0');
    stream.bulk(std::as_writable_bytes(std::span(packed)));
    Unpacker from(packed);
    Raster raster;
    visit_header(raster, [&](auto& member) { from.take(member); });
    counts.padding = from.number<std::size_t>();
    counts.pixels = from.number<std::size_t>();
    return raster;
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
    bool is_asked = false;  // readers ask again where pixels told more: the caller does so at the end
    const Raster raster = read_raster_here(path, [&](const Raster& header) {
        if (std::exchange(is_asked, true)) return;
        send_header(reply, header);
        reply.wait_for_consent();
    });
    send_header(reply, raster);
    std::vector<std::byte> padding;
    for (const bool is : raster.is_padding) padding.push_back(std::byte{is});
    reply.bulk(padding);
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
        PixelBytes counts;
        const Raster header = receive_header(stream, counts);
        if (check) check(header);
        stream.consent();
        raster = receive_header(stream, counts);  // what the pixels told besides
        if (check) check(raster);
        std::vector<std::byte> padding;
        take_memory(padding, counts.padding, path);
        stream.bulk(padding);
        for (const std::byte is : padding) raster.is_padding.push_back(is != std::byte{0});
        take_memory(raster.bytes, counts.pixels, path);
        stream.bulk(raster.bytes);
    });
    return is_read ? raster : read_raster_here(path, check);
}

Raster read_raster_header(const std::filesystem::path& path) {
    check_readable_file(path);
    Raster raster;
    const bool is_read = decode({&decode_header, path, {}, limits_for(path)}, [&](DecodedStream& stream) {
        PixelBytes ignored;
        raster = receive_header(stream, ignored);
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

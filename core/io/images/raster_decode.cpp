#include <algorithm>

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
    Packer packer;
    visit_header(raster, [&](const auto& member) { packer.add(member); });
    return packer.add(raster.bytes.size()).bytes();
}

/// Sets how many bytes the pixels have, too, without taking memory for them.
Raster unpacked_header(std::string_view packed, std::size_t& byte_count) {
    Unpacker from(packed);
    Raster raster;
    visit_header(raster, [&](auto& member) { from.take(member); });
    byte_count = from.number<std::size_t>();
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
    const Raster raster = read_raster_here(path, [&](const Raster& header) {
        reply.message(packed_header(header));
        reply.wait_for_consent();
    });
    reply.message(packed_header(raster));
    reply.bulk(raster.bytes);
}

void decode_header(const std::filesystem::path& path, const std::string&, DecoderReply& reply) {
    try {
        (void)read_raster_here(path, [&](const Raster& header) {
            reply.message(packed_header(header));
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
        std::size_t byte_count = 0;
        const Raster header = unpacked_header(stream.message(), byte_count);
        if (check) check(header);
        stream.consent();
        raster = unpacked_header(stream.message(), byte_count);  // what the pixels told besides
        take_memory(raster.bytes, byte_count, path);
        stream.bulk(raster.bytes);
    });
    return is_read ? raster : read_raster_here(path, check);
}

Raster read_raster_header(const std::filesystem::path& path) {
    check_readable_file(path);
    Raster raster;
    const bool is_read = decode({&decode_header, path, {}, limits_for(path)}, [&](DecodedStream& stream) {
        std::size_t none = 0;
        raster = unpacked_header(stream.message(), none);
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

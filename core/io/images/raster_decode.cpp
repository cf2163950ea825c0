#include <algorithm>

#include "core/io/decode/decoder.h"
#include "core/io/decode/pack.h"
#include "core/io/files/file_format.h"
#include "core/io/images/raster.h"

namespace raylign::detail {
namespace {

struct HeaderOnly {};  // thrown to end a reading: it goes no further than this file

std::string packed_header(const Raster& raster) {
    // As many names as Raster has members: a new one that is not packed does not compile.
    const auto& [format, size, spacing_mm, origin_mm, direction, type, components, white_is_zero, bits_stored,
                 inverted_sum, bytes] = raster;
    Packer packer;
    packer.add(format).add(size).add(spacing_mm).add(origin_mm).add(direction.rows()).add(direction.cols());
    for (Eigen::Index i = 0; i < direction.size(); ++i) packer.add(direction.data()[i]);
    packer.add(type).add(components).add(white_is_zero).add(bits_stored).add(inverted_sum);
    return packer.add(bytes.size()).bytes();
}

/// Sets how many bytes the pixels have, too, without taking memory for them.
Raster unpacked_header(std::string_view packed, std::size_t& byte_count) {
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
    raster.bits_stored = from.number<int>();
    raster.inverted_sum = from.number<double>();
    byte_count = from.number<std::size_t>();
    return raster;
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
        raster.bytes.resize(byte_count);  // as many as the decoder has: no mere claim of a header
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

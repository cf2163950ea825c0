#include "core/io/dicom/codestream.h"

#include <algorithm>
#include <string_view>

#include "core/base/error.h"

namespace raylign::detail {
namespace {

/// Big-endian numbers of a codestream, with an Error where it ends.
class BigEndianBytes {
public:
    BigEndianBytes(const std::string& stream, const std::string& where) : stream_(stream), where_(where) {}

    [[nodiscard]] std::uint32_t number(std::size_t at, std::size_t count) const {
        if (at + count > stream_.size()) throw Error(where_ + ": its compressed pixels end within their header");
        std::uint32_t value = 0;
        for (std::size_t i = 0; i < count; ++i) value = (value << 8) | static_cast<unsigned char>(stream_[at + i]);
        return value;
    }

private:
    const std::string& stream_;
    const std::string& where_;
};

bool is_frame_header(std::uint32_t marker) {
    // SOF0 to SOF15 but for DHT, JPG and DAC, which lie among them; SOF55 is JPEG-LS.
    return (marker >= 0xffc0 && marker <= 0xffcf && marker != 0xffc4 && marker != 0xffc8 && marker != 0xffcc) ||
           marker == 0xfff7;
}

CodestreamHeader jpeg_header(const std::string& stream, PixelCodec codec, const std::string& where) {
    const BigEndianBytes bytes(stream, where);
    if (bytes.number(0, 2) != 0xffd8) throw Error(where + ": its compressed pixels do not begin as JPEG");
    CodestreamHeader header;
    for (std::size_t at = 2;;) {
        const std::uint32_t marker = bytes.number(at, 2);
        if (marker == 0xffff) {  // a fill byte
            ++at;
            continue;
        }
        if (marker == 0xffda && header.precision > 0) return header;  // its pixels follow
        if (marker < 0xff01 || marker == 0xffda) throw Error(where + ": its JPEG has no frame header");
        if (is_frame_header(marker)) {
            if ((marker == 0xfff7) != (codec == PixelCodec::jpeg_ls)) {
                throw Error(where +
                            ": its compressed pixels are of another kind of JPEG than its transfer syntax says");
            }
            header = {bytes.number(at + 7, 2), bytes.number(at + 5, 2), static_cast<int>(bytes.number(at + 9, 1)),
                      static_cast<int>(bytes.number(at + 4, 1)), false};
        }
        const std::uint32_t length = bytes.number(at + 2, 2);
        if (length < 2) throw Error(where + ": its JPEG has a segment of no length");
        at += 2 + length;
    }
}

CodestreamHeader jpeg_2000_header(const std::string& stream, const std::string& where) {
    const BigEndianBytes bytes(stream, where);
    if (bytes.number(0, 4) != 0xff4fff51) throw Error(where + ": its compressed pixels do not begin as JPEG 2000");
    const std::uint64_t right = bytes.number(8, 4), bottom = bytes.number(12, 4), left = bytes.number(16, 4),
                        top = bytes.number(20, 4);
    if (right <= left || bottom <= top) throw Error(where + ": its JPEG 2000 image has no pixels");
    if (bytes.number(24, 4) == 0 || bytes.number(28, 4) == 0) throw Error(where + ": its JPEG 2000 tiles have no size");
    const std::uint32_t samples = bytes.number(40, 2), depth = bytes.number(42, 1);
    for (std::uint32_t i = 0; i < samples; ++i) {
        const std::uint32_t component = bytes.number(42 + 3 * std::size_t{i}, 3);
        if (component != ((depth << 16) | 0x0101)) {
            throw Error(where + ": the components of its JPEG 2000 differ in depth or are subsampled");
        }
    }
    return {right - left, bottom - top, static_cast<int>(samples), static_cast<int>((depth & 0x7f) + 1),
            (depth & 0x80) != 0};
}

/// Unpacks one segment to every `step`th byte of `to`, from `first`. Returns how many it gave.
std::size_t unpack(std::string_view packed, std::size_t first, std::size_t step, std::string& to) {
    std::size_t given = 0;
    const std::size_t most = to.size() / step;
    for (std::size_t at = 0; at < packed.size() && given < most;) {
        const auto control = static_cast<signed char>(packed[at++]);
        if (control == -128) continue;
        const std::size_t count = control >= 0 ? static_cast<std::size_t>(control) + 1
                                               : static_cast<std::size_t>(1 - static_cast<int>(control));
        for (std::size_t i = 0; i < count && given < most; ++i) {
            const std::size_t from = control >= 0 ? at + i : at;
            if (from >= packed.size()) return given;
            to[first + step * given++] = packed[from];
        }
        at += control >= 0 ? count : 1;
    }
    return given;
}

std::uint32_t little_endian_at(const std::string& stream, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 4; i > 0; --i) value = (value << 8) | static_cast<unsigned char>(stream[at + i - 1]);
    return value;
}

/// Where a frame's fragments begin, by the bytes of a codestream's beginning.
bool begins_frame(const DicomFile& file, const ByteRange& part) {
    if (part.length < 3) return false;
    const std::string head = file.bytes({part.offset, 3});
    return head == "\xff\xd8\xff" || head == "\xff\x4f\xff";
}

}  // namespace

CodestreamHeader codestream_header(const std::string& stream, PixelCodec codec, const std::string& where) {
    return codec == PixelCodec::jpeg_2000 ? jpeg_2000_header(stream, where) : jpeg_header(stream, codec, where);
}

void check_codestream(const CodestreamHeader& header, const PixelLayout& layout, const std::string& where) {
    const auto must_be = [&](const char* what, std::uint64_t value, int wanted, const char* element) {
        if (value == static_cast<std::uint64_t>(wanted)) return;
        throw bad_value(std::string(what) + " of the compressed image", std::to_string(value),
                        std::string(element) + " = " + std::to_string(wanted), where);
    };
    must_be("columns", header.columns, layout.size.x(), "Columns (0028,0011)");
    must_be("rows", header.rows, layout.size.y(), "Rows (0028,0010)");
    must_be("samples per pixel", static_cast<std::uint64_t>(header.samples), layout.samples,
            "SamplesPerPixel (0028,0002)");
    constexpr int kMostBits = 16;  // of the decoders
    if (header.precision < 2 || header.precision > std::min(kMostBits, layout.bits_allocated)) {
        throw bad_value("bits of the compressed image", std::to_string(header.precision),
                        "in [2, " + std::to_string(std::min(kMostBits, layout.bits_allocated)) +
                            "], the latter BitsAllocated (0028,0100)",
                        where);
    }
}

void check_jpeg_2000_end(const std::string& stream, const std::string& where) {
    constexpr std::size_t kTail = 8;  // bytes that writers leave behind
    const std::size_t from = stream.size() > kTail ? stream.size() - kTail : 0;
    if (stream.find("\xff\xd9", from) != std::string::npos) return;
    throw Error(where + ": its JPEG 2000 pixels do not end with the end mark FF D9 (truncated?)");
}

std::string decode_rle(const std::string& stream, const PixelLayout& layout, const std::string& where) {
    constexpr std::size_t kRleHeader = 64;
    const auto wanted = static_cast<std::uint32_t>(layout.samples * layout.bits_allocated / 8);
    if (stream.size() < kRleHeader) throw Error(where + ": its RLE pixels end within their header of 64 bytes");
    const std::uint32_t count = little_endian_at(stream, 0);
    if (count != wanted) {
        throw bad_value("number of RLE segments", std::to_string(count),
                        std::to_string(wanted) + ", one for each byte of a pixel", where);
    }
    std::string pixels(layout.frame_bytes(), '\0');
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint64_t begin = little_endian_at(stream, 4 + 4 * std::size_t{i});
        const std::uint64_t end = i + 1 < count ? little_endian_at(stream, 8 + 4 * std::size_t{i}) : stream.size();
        if (begin < kRleHeader || end < begin || end > stream.size()) {
            throw bad_value("offset of RLE segment " + std::to_string(i + 1), std::to_string(begin),
                            "in [64, " + std::to_string(stream.size()) + "], rising", where);
        }
        // One sample a pixel: segments go from the highest byte to the lowest.
        const std::string_view packed = std::string_view(stream).substr(begin, end - begin);
        if (unpack(packed, count - 1 - i, count, pixels) == layout.frame_pixels()) continue;
        throw Error(where + ": RLE segment " + std::to_string(i + 1) +
                    " holds fewer pixels than Rows x Columns = " + std::to_string(layout.frame_pixels()));
    }
    return pixels;
}

std::vector<std::vector<ByteRange>> frames_of_fragments(const DicomFile& file, int frames) {
    const auto count = static_cast<std::size_t>(frames);
    std::vector<std::vector<ByteRange>> parts;
    if (count == 1) return {file.pixel_parts};
    const bool one_each = file.pixel_parts.size() == count;
    const bool by_table = file.offsets.size() == count;
    for (const ByteRange& part : file.pixel_parts) {
        const std::uint64_t from_first = part.offset - file.pixel_parts.front().offset;
        const bool is_new = one_each || (by_table ? parts.size() < count && file.offsets[parts.size()] == from_first
                                                  : begins_frame(file, part));
        if (is_new) parts.emplace_back();
        if (parts.empty()) break;
        parts.back().push_back(part);
    }
    if (parts.size() == count) return parts;
    throw Error(file.name + ": its " + std::to_string(file.pixel_parts.size()) +
                " compressed parts cannot be shared among NumberOfFrames (0028,0008) = " + std::to_string(frames) +
                (by_table ? ": the offset table points elsewhere" : ": there is no offset table"));
}

}  // namespace raylign::detail

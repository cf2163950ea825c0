#include "core/io/dicom/frame_decoder.h"

#include <gdcmImageReader.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <sstream>
#include <utility>

#include "core/base/error.h"
#include "core/io/dicom/codestream.h"
#include "core/io/dicom/dicom_writer.h"
#include "core/io/dicom/transfer_syntax.h"
#include "core/io/files/text.h"
#include "core/io/images/quiet_itk.h"

namespace raylign::detail {
namespace {

/// A file of one grey image that says of itself what its codestream says.
std::string file_of_codestream(const std::string& stream, const CodestreamHeader& header, const std::string& syntax) {
    const std::string any_class = "1.2.840.10008.5.1.4.1.1.7", any_uid = "1.2.3";
    const auto us = [](std::uint64_t value) { return static_cast<std::uint16_t>(value); };
    DicomWriter writer;
    writer.text(0x00080016, "UI", any_class).text(0x00080018, "UI", any_uid).number(0x00280002, 1);
    writer.text(0x00280004, "CS", "MONOCHROME2").number(kRowsTag, us(header.rows));
    writer.number(kColumnsTag, us(header.columns)).number(0x00280100, header.precision > 8 ? 16 : 8);
    writer.number(0x00280101, us(static_cast<std::uint64_t>(header.precision)));
    writer.number(0x00280102, us(static_cast<std::uint64_t>(header.precision - 1)));
    writer.number(0x00280103, header.is_signed ? 1 : 0).compressed_pixels(stream);
    return writer.file(any_class, any_uid, syntax);
}

/// A JPEG without what programs add to it (APPn, comments): GDCM aborts on some, and grey pixels need none.
std::string without_additions(const std::string& stream) {
    std::string bare = stream.substr(0, 2);
    std::size_t at = 2;
    const auto byte = [&](std::size_t i) { return static_cast<unsigned>(static_cast<unsigned char>(stream[i])); };
    while (at + 4 <= stream.size() && byte(at + 1) != 0xda) {
        if (byte(at + 1) == 0xff) {  // a fill byte
            ++at;
            continue;
        }
        const std::size_t length = 2 + 256 * byte(at + 2) + byte(at + 3);
        const bool is_addition = (byte(at + 1) & 0xf0) == 0xe0 || byte(at + 1) == 0xfe;
        if (!is_addition) bare += stream.substr(at, length);
        at += length;
    }
    return bare + stream.substr(std::min(at, stream.size()));
}

/// While it lives, what C libraries print to standard error is kept: it is their only channel for damaged pixels that
/// they go on with. Process-wide, as QuietItk.
class KeptStderr {
public:
    KeptStderr() : kept_(std::tmpfile()), stderr_(::dup(STDERR_FILENO)) {
        std::fflush(stderr);
        if (kept_ != nullptr) ::dup2(::fileno(kept_), STDERR_FILENO);
    }
    ~KeptStderr() {
        restore();
        if (kept_ != nullptr) std::fclose(kept_);
    }
    KeptStderr(const KeptStderr&) = delete;
    KeptStderr& operator=(const KeptStderr&) = delete;

    /// The first line; puts standard error back.
    [[nodiscard]] std::string first_line() {
        restore();
        std::array<char, 200> line{};
        if (kept_ == nullptr) return {};
        std::rewind(kept_);
        const char* const read = std::fgets(line.data(), line.size(), kept_);
        return read == nullptr ? std::string() : std::string(trimmed(read));
    }

private:
    void restore() {
        if (stderr_ < 0) return;
        std::fflush(stderr);
        ::dup2(stderr_, STDERR_FILENO);
        ::close(stderr_);
        stderr_ = -1;
    }
    std::FILE* kept_;
    int stderr_;
};

std::string decode_by_gdcm(const std::string& stream, const CodestreamHeader& header, const DicomFile& file) {
    const QuietItk quiet;
    KeptStderr kept;
    std::istringstream bytes(file_of_codestream(stream, header, file.syntax));
    gdcm::ImageReader reader;
    reader.SetStream(bytes);
    const std::size_t wanted = header.columns * header.rows * (header.precision > 8 ? 2 : 1);
    std::string pixels;
    bool is_read = reader.Read();
    if (is_read) {
        pixels.resize(reader.GetImage().GetBufferLength());
        is_read = pixels.size() == wanted && reader.GetImage().GetBuffer(pixels.data());
    }
    const std::string complaint = kept.first_line();
    const bool is_harmless = complaint.find("extraneous bytes before marker") != std::string::npos;
    if (is_read && (complaint.empty() || is_harmless)) return pixels;
    throw Error(file.name + ": its compressed pixels cannot be decoded (truncated or damaged?)" +
                (complaint.empty() ? "" : ": " + complaint));
}

/// Pixels of fewer bytes than BitsAllocated says.
std::string widened(const std::string& pixels, std::size_t from, std::size_t to, bool is_signed) {
    if (from == to) return pixels;
    std::string wide;
    for (std::size_t at = 0; at < pixels.size(); at += from) {
        const bool is_negative = is_signed && (static_cast<unsigned char>(pixels[at + from - 1]) & 0x80) != 0;
        wide.append(pixels, at, from).append(to - from, is_negative ? '\xff' : '\0');
    }
    return wide;
}

void swap_groups(std::string& bytes, std::size_t width) {
    for (std::size_t at = 0; at + width <= bytes.size(); at += width) {
        const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(at);
        std::reverse(begin, begin + static_cast<std::ptrdiff_t>(width));
    }
}

}  // namespace

FrameDecoder::FrameDecoder(const DicomFile& file, const PixelLayout& layout) : file_(file), layout_(layout) {
    if (file.is_encapsulated) parts_ = frames_of_fragments(file, layout.frames);
}

std::string FrameDecoder::operator()(int frame) const {
    const std::size_t frame_bytes = layout_.frame_bytes();
    const auto width = static_cast<std::size_t>(layout_.bits_allocated / 8);
    if (!file_.is_encapsulated) {
        // 8-bit pixels in words come two to a word: an odd frame shares its last word with the next one.
        const std::size_t group = width == 1 && file_.is_word && file_.is_big_endian ? 2 : width;
        const std::uint64_t begin = static_cast<std::uint64_t>(frame) * frame_bytes, first = begin / group * group;
        const std::uint64_t there = file_.pixel_parts.front().length;
        const std::uint64_t last = std::min<std::uint64_t>(there, (begin + frame_bytes + group - 1) / group * group);
        std::string pixels = file_.bytes({file_.pixel_parts.front().offset + first, last - first});
        if (file_.is_big_endian) swap_groups(pixels, group);
        return pixels.substr(begin - first, frame_bytes);
    }
    std::string stream;
    for (const ByteRange& part : parts_[static_cast<std::size_t>(frame)]) stream += file_.bytes(part);
    const PixelCodec codec = pixel_codec(file_.syntax);
    if (codec == PixelCodec::rle) return decode_rle(stream, layout_, file_.name);
    const CodestreamHeader header = codestream_header(stream, codec, file_.name);
    check_codestream(header, layout_, file_.name);
    if (codec == PixelCodec::jpeg_2000) check_jpeg_2000_end(stream, file_.name);
    if (codec == PixelCodec::jpeg) stream = without_additions(stream);
    return widened(decode_by_gdcm(stream, header, file_), header.precision > 8 ? 2 : 1, width, header.is_signed);
}

}  // namespace raylign::detail

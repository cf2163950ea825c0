#include "core/io/dicom/frame_decoder.h"

#include <gdcmImageReader.h>

#include <algorithm>
#include <sstream>
#include <utility>

#include "core/base/error.h"
#include "core/io/dicom/codestream.h"
#include "core/io/dicom/dicom_writer.h"
#include "core/io/dicom/transfer_syntax.h"
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

std::string decode_by_gdcm(const std::string& stream, const CodestreamHeader& header, const DicomFile& file) {
    const QuietItk quiet;
    std::istringstream bytes(file_of_codestream(stream, header, file.syntax));
    gdcm::ImageReader reader;
    reader.SetStream(bytes);
    const std::string problem = file.name + ": its compressed pixels cannot be decoded (truncated or damaged?)";
    if (!reader.Read()) throw Error(problem);
    const gdcm::Image& image = reader.GetImage();
    const std::size_t wanted = header.columns * header.rows * (header.precision > 8 ? 2 : 1);
    std::string pixels(image.GetBufferLength(), '\0');
    if (pixels.size() != wanted || !image.GetBuffer(pixels.data())) throw Error(problem);
    return pixels;
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
    return widened(decode_by_gdcm(stream, header, file_), header.precision > 8 ? 2 : 1, width, header.is_signed);
}

}  // namespace raylign::detail

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/io/dicom/pixel_layout.h"
#include "core/io/dicom/transfer_syntax.h"

namespace raylign::detail {

/// What the header of a compressed image says.
struct CodestreamHeader {
    std::uint64_t columns = 0, rows = 0;
    int samples = 0, precision = 0;  ///< bits
    bool is_signed = false;          ///< JPEG 2000 only
};

/// The header of a JPEG, JPEG-LS or JPEG 2000 codestream. Throws Error naming `where` for anything else.
[[nodiscard]] CodestreamHeader codestream_header(const std::string& stream, PixelCodec codec, const std::string& where);

/// Throws Error where a codestream holds another image than the tags say: decoders write what it says.
void check_codestream(const CodestreamHeader& header, const PixelLayout& layout, const std::string& where);

/// Throws Error where a JPEG 2000 codestream lacks its end mark: decoders make something of what is left.
void check_jpeg_2000_end(const std::string& stream, const std::string& where);

/// Decodes a frame of RLE (PackBits of each byte of the pixels, highest first; DICOM PS3.5, annex G) to little-endian
/// pixels. Throws Error for segments that do not fit the layout or the stream, and for too few pixels.
[[nodiscard]] std::string decode_rle(const std::string& stream, const PixelLayout& layout, const std::string& where);

/// The compressed bytes of each frame: fragments by the offset table, else one each, else where codestreams begin.
/// Throws Error where they cannot be told apart.
[[nodiscard]] std::vector<std::vector<ByteRange>> frames_of_fragments(const DicomFile& file, int frames);

}  // namespace raylign::detail

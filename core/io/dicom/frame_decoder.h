#pragma once

#include <string>
#include <vector>

#include "core/io/dicom/dicom_file.h"
#include "core/io/dicom/pixel_layout.h"

namespace raylign::detail {

/// Gives the pixels of a grey DICOM file's frames, one at a time: BitsAllocated each, little endian. RLE and
/// uncompressed pixels are read here; JPEG, JPEG-LS and JPEG 2000 are decoded by GDCM, which gets nothing of the file
/// but codestreams that were checked and a header made for them, as it aborts or writes beyond its buffers on others.
/// Borrows `file` while it lives.
class FrameDecoder {
public:
    /// Throws Error where frames cannot be told apart in compressed pixels.
    FrameDecoder(const DicomFile& file, const PixelLayout& layout);

    /// Frame `frame`, from 0. Throws Error, naming the file, for damaged pixels.
    [[nodiscard]] std::string operator()(int frame) const;

private:
    const DicomFile& file_;
    PixelLayout layout_;
    std::vector<std::vector<ByteRange>> parts_;  ///< of compressed frames
};

}  // namespace raylign::detail

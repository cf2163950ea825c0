#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <memory>
#include <string>
#include <vector>

#include "core/io/dicom/dicom_tags.h"

namespace raylign::detail {

/// Some bytes of a file.
struct ByteRange {
    std::uint64_t offset = 0, length = 0;
};

/// A DICOM file as far as its pixels, which are not read yet.
struct DicomFile {
    std::string name;  ///< for messages
    DicomTags tags;
    std::string syntax;  ///< transfer syntax UID; "" where a file without preamble does not say it
    bool is_big_endian = false;
    bool is_word = false;                ///< the pixels are OW: swapped by pairs of bytes in big-endian files
    bool is_encapsulated = false;        ///< the pixels are compressed
    std::vector<ByteRange> pixel_parts;  ///< one part; or the fragments, after the offset table
    std::vector<std::uint64_t> offsets;  ///< of the frames, from the first fragment's item; empty = not told
    std::shared_ptr<std::istream> stream;

    [[nodiscard]] std::string bytes(const ByteRange& range) const;  ///< throws Error where they cannot be read
};

/// Reads everything before the pixels, in all transfer syntaxes (deflated files are inflated in memory), with and
/// without preamble. Throws Error where the file ends too soon or is not well formed; nothing is allocated that the
/// file does not hold.
[[nodiscard]] DicomFile open_dicom(const std::filesystem::path& path);

/// Inflates a data set of the deflated transfer syntax. Throws Error, naming the file, for damaged data.
[[nodiscard]] std::string inflated(const std::string& deflated, const std::string& name);

}  // namespace raylign::detail

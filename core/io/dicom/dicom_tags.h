#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace raylign::detail {

inline constexpr std::uint32_t kRowsTag = 0x00280010, kColumnsTag = 0x00280011;

/// The file's top-level elements whose values are short, by (group << 16) + element; without nested ones.
struct DicomTags {
    /// As stored, blanks and zeros at both ends removed; US and SS as text.
    std::map<std::uint32_t, std::string> values;
    bool has_pixels = false;

    [[nodiscard]] std::string text(std::uint32_t tag) const;
    /// Numbers separated by backslashes; empty unless there are `count` finite ones.
    [[nodiscard]] std::vector<double> numbers(std::uint32_t tag, std::size_t count) const;
    /// As many as there are; empty where one is no finite number.
    [[nodiscard]] std::vector<double> all_numbers(std::uint32_t tag) const;
    [[nodiscard]] double number(std::uint32_t tag, double otherwise) const;
};

/// Walks the whole structure of a DICOM file, since GDCM fills missing pixels with zeros and, as Debian builds it,
/// aborts the process on files cut off within their tags. Empty for a file without DICOM's mark at byte 128. Throws
/// Error where the file ends too soon, is not well formed, has fewer pixels than its tags say, or is deflated (rare,
/// and not looked into).
[[nodiscard]] std::optional<DicomTags> read_dicom_tags(const std::filesystem::path& path);

}  // namespace raylign::detail

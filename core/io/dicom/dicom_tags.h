#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace raylign::detail {

inline constexpr std::uint32_t kRowsTag = 0x00280010, kColumnsTag = 0x00280011;

/// A data set of a DICOM file: its elements whose values are short, by (group << 16) + element, and those sequences
/// that raylign reads.
struct DicomTags {
    /// As stored, blanks and zeros at both ends removed; binary numbers as text, backslashes between; lookup tables as
    /// they are.
    std::map<std::uint32_t, std::string> values;
    std::map<std::uint32_t, std::vector<DicomTags>> items;  ///< of sequences
    bool has_pixels = false;

    [[nodiscard]] bool has(std::uint32_t tag) const { return values.contains(tag); }
    [[nodiscard]] std::string text(std::uint32_t tag) const;
    /// Numbers separated by backslashes; empty unless there are `count` finite ones.
    [[nodiscard]] std::vector<double> numbers(std::uint32_t tag, std::size_t count) const;
    /// As many as there are; empty where one is no finite number.
    [[nodiscard]] std::vector<double> all_numbers(std::uint32_t tag) const;
    [[nodiscard]] double number(std::uint32_t tag, double otherwise) const;
    /// The first item of a sequence; null where there is none.
    [[nodiscard]] const DicomTags* item(std::uint32_t sequence) const;
};

/// Whether the file has DICOM's mark at byte 128, or begins with DICOM elements without that preamble.
[[nodiscard]] bool looks_like_dicom(const std::filesystem::path& path);

/// Walks the whole structure of a DICOM file up to its pixels. Empty for a file that does not look like DICOM. Throws
/// Error where the file ends too soon or is not well formed.
[[nodiscard]] std::optional<DicomTags> read_dicom_tags(const std::filesystem::path& path);

}  // namespace raylign::detail

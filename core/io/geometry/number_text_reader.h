#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace raylign::detail {

/// A line of a text file with its number, from 1.
struct TextLine {
    int number = 0;
    std::string text;  ///< trimmed, unless told to keep the indent
};

enum class KeepIndent { no, yes };

/// The lines that are not blank, with line ends of any system. Throws Error for a file larger than `most_bytes` or with
/// bytes that are no text.
[[nodiscard]] std::vector<TextLine> text_lines(const std::filesystem::path& path,
                                               KeepIndent keep_indent = KeepIndent::no,
                                               std::uintmax_t most_bytes = 64 << 20);

/// The finite numbers of a line, separated by commas or blanks; none where it has anything else.
[[nodiscard]] std::optional<std::vector<double>> number_parts(std::string_view line);

/// The numbers of one line, separated by commas or blanks. Throws Error unless there are `count` finite ones.
[[nodiscard]] std::vector<double> line_numbers(const TextLine& line, std::size_t count, const std::string& what,
                                               const std::filesystem::path& path);

}  // namespace raylign::detail

#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace raylign::detail {

// What the headers in words of MetaImage and NRRD have in common.

/// A header's lines and where the bytes after it begin.
struct HeaderLines {
    std::vector<std::string> lines;  ///< without line ends
    std::uint64_t end = 0;
};

/// Reads lines up to the one of which `is_last` says so, or to the end of the file. Throws Error where that takes more
/// than 4 MiB.
[[nodiscard]] HeaderLines read_header_lines(const std::filesystem::path& path,
                                            const std::function<bool(std::string_view)>& is_last);

/// The words between blanks.
[[nodiscard]] std::vector<std::string_view> words_in(std::string_view text);

/// `count` finite numbers between blanks. Throws Error that names `key`.
[[nodiscard]] std::vector<double> numbers_in(std::string_view text, std::size_t count, const std::string& key,
                                             const std::filesystem::path& where);

/// A whole number in [least, most]. Throws Error that names `key`.
[[nodiscard]] int whole_number(std::string_view text, int least, int most, const std::string& key,
                               const std::filesystem::path& where);

/// The files of a pattern such as "slice%03d.raw" for the numbers first, first + step, ... up to last. One %d with a
/// width of at most two digits is allowed, and %% for a percent sign. Throws Error for other patterns.
struct NumberRange {
    std::int64_t first = 1, last = 1, step = 1;
};
[[nodiscard]] std::vector<std::string> files_of_pattern(std::string_view pattern, const NumberRange& range,
                                                        const std::filesystem::path& where);

/// The file of pixels that a header names, beside it or absolute. Throws Error for a name that is none (too long, with
/// control characters), and for pipes and devices, whose reading may never end.
[[nodiscard]] std::filesystem::path data_file(const std::filesystem::path& header, const std::string& name);

/// How many files hold `size` where each holds its first `dimensions` axes: the product of the others.
[[nodiscard]] double files_needed(std::span<const int> size, int dimensions);

/// Throws Error where the header names another count of files than its size asks for.
void check_file_count(std::size_t named, std::span<const int> size, int dimensions, const std::filesystem::path& where);

}  // namespace raylign::detail

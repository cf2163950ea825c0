#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace raylign::detail {

constexpr std::uintmax_t kMostTextBytes = std::uintmax_t{1} << 30;  // tables of points and poses; none comes near

/// All of a text file. Line ends of any system become \n; UTF-8's byte order mark is left out. Throws Error for a file
/// larger than `most_bytes`, for UTF-16 and for bytes that are no text.
[[nodiscard]] std::string read_text_file(const std::filesystem::path& path, std::uintmax_t most_bytes = kMostTextBytes);

/// Throws Error where these first bytes of a file are UTF-16 or UTF-32: no reader here knows them.
void refuse_utf16(std::string_view head, const std::filesystem::path& path);

}  // namespace raylign::detail

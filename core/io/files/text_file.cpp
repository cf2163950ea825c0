#include "core/io/files/text_file.h"

#include <algorithm>
#include <fstream>
#include <iterator>

#include "core/base/error.h"
#include "core/io/files/file_format.h"

namespace raylign::detail {

void refuse_utf16(std::string_view head, const std::filesystem::path& path) {
    using namespace std::string_view_literals;
    const bool has_mark = head.starts_with("\xFF\xFE"sv) || head.starts_with("\xFE\xFF"sv);
    // Text without a mark: every other byte of what is ASCII is 0.
    const bool is_wide = head.size() >= 4 && head[0] != '\0' && head[1] == '\0' && head[2] != '\0' && head[3] == '\0';
    const bool is_wide_swapped =
        head.size() >= 4 && head[0] == '\0' && head[1] != '\0' && head[2] == '\0' && head[3] != '\0';
    if (!has_mark && !is_wide && !is_wide_swapped) return;
    throw Error(path.string() + " is UTF-16 text: must be UTF-8 (or plain ASCII); save it again as that");
}

std::string read_text_file(const std::filesystem::path& path, std::uintmax_t most_bytes) {
    check_readable_file(path);
    if (std::filesystem::file_size(path) > most_bytes) {
        constexpr std::uintmax_t kMega = 1 << 20;
        throw bad_value("size of the text file", std::to_string(std::filesystem::file_size(path)) + " bytes",
                        "at most " + std::to_string(most_bytes / kMega) + " MB of text", path.string());
    }
    std::ifstream file(path, std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(file), {}};
    refuse_utf16(text, path);
    if (text.find('\0') != std::string::npos) throw Error(path.string() + " is no text file");
    std::string lines;
    lines.reserve(text.size());
    for (std::size_t i = text.starts_with("\xEF\xBB\xBF") ? 3 : 0; i < text.size(); ++i) {
        const bool is_return = text[i] == '\r';  // a lone one ends a line on old Macintoshes
        if (is_return && i + 1 < text.size() && text[i + 1] == '\n') continue;
        lines += is_return ? '\n' : text[i];
    }
    return lines;
}

}  // namespace raylign::detail

#include "core/io/images/header_text.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "core/base/error.h"
#include "core/io/files/text.h"
#include "core/io/images/raster.h"

namespace raylign::detail {

HeaderLines read_header_lines(const std::filesystem::path& path, const std::function<bool(std::string_view)>& is_last) {
    constexpr std::size_t kMost = 4 << 20;
    std::ifstream file(path, std::ios::binary);
    HeaderLines header;
    std::string line;
    for (char c = 0; file.get(c);) {
        if (++header.end > kMost) throw Error(path.string() + " is damaged: its header does not end within 4 MiB");
        if (c != '\n') {
            line += c;
            continue;
        }
        if (line.ends_with('\r')) line.pop_back();
        header.lines.push_back(std::move(line));
        line.clear();
        if (is_last(header.lines.back())) return header;
    }
    if (!line.empty()) header.lines.push_back(std::move(line));
    return header;
}

std::vector<std::string_view> words_in(std::string_view text) {
    std::vector<std::string_view> words;
    constexpr std::string_view kBlanks = " \t\r\n";
    for (std::size_t begin = text.find_first_not_of(kBlanks); begin != std::string_view::npos;) {
        const std::size_t end = std::min(text.find_first_of(kBlanks, begin), text.size());
        words.push_back(text.substr(begin, end - begin));
        begin = text.find_first_not_of(kBlanks, end);
    }
    return words;
}

std::vector<double> numbers_in(std::string_view text, std::size_t count, const std::string& key,
                               const std::filesystem::path& where) {
    std::vector<double> numbers;
    for (const std::string_view word : words_in(text)) {
        const std::optional<double> number = number_from(word);
        if (!number || !std::isfinite(*number)) break;
        numbers.push_back(*number);
    }
    if (numbers.size() == count && words_in(text).size() == count) return numbers;
    throw bad_value(key, "\"" + std::string(text.substr(0, 80)) + "\"", std::to_string(count) + " finite numbers",
                    where.string());
}

int whole_number(std::string_view text, int least, int most, const std::string& key,
                 const std::filesystem::path& where) {
    const std::optional<double> number = number_from(text);
    if (number && *number >= least && *number <= most && *number == std::round(*number)) {
        return static_cast<int>(*number);
    }
    throw bad_value(key, "\"" + std::string(text.substr(0, 80)) + "\"",
                    "a whole number in [" + std::to_string(least) + ", " + std::to_string(most) + "]", where.string());
}

namespace {

/// A file name with one place for a number.
struct FilePattern {
    std::string before, after;
    std::size_t width = 0;
    char fill = ' ';
    int places = 0;
};

FilePattern parse_pattern(std::string_view pattern, const std::filesystem::path& where) {
    FilePattern parsed;
    for (std::size_t i = 0; i < pattern.size(); ++i) {
        std::string& part = parsed.places == 0 ? parsed.before : parsed.after;
        if (pattern[i] != '%') {
            part += pattern[i];
            continue;
        }
        const std::size_t end = std::min(pattern.find_first_not_of("0123456789", i + 1), pattern.size());
        const std::string_view digits = pattern.substr(i + 1, end - i - 1);
        const char kind = end < pattern.size() ? pattern[end] : '\0';
        if (kind == '%' && digits.empty()) {
            part += '%';
        } else if ((kind == 'd' || kind == 'i') && digits.size() <= 2 && ++parsed.places == 1) {
            if (digits.starts_with('0')) parsed.fill = '0';
            parsed.width = static_cast<std::size_t>(number_from(digits).value_or(0));
        } else {
            throw bad_value("pattern of files", "\"" + std::string(pattern.substr(0, 80)) + "\"",
                            "a name with one %d, such as slice%03d.raw", where.string());
        }
        i = end;
    }
    return parsed;
}

}  // namespace

std::vector<std::string> files_of_pattern(std::string_view pattern, const NumberRange& range,
                                          const std::filesystem::path& where) {
    const FilePattern parsed = parse_pattern(pattern, where);
    constexpr double kMost = 1e6;
    const double count =
        std::floor(static_cast<double>(range.last - range.first) / static_cast<double>(range.step)) + 1;
    if (range.step == 0 || !(count >= 1 && count <= kMost)) {
        throw bad_value(
            "numbers of the pattern",
            std::to_string(range.first) + " to " + std::to_string(range.last) + " by " + std::to_string(range.step),
            "a range of 1 to 1000000 numbers", where.string());
    }
    std::vector<std::string> files;
    for (std::int64_t i = 0; i < static_cast<std::int64_t>(count); ++i) {
        std::string digits = std::to_string(range.first + i * range.step);
        if (digits.size() < parsed.width) digits.insert(0, parsed.width - digits.size(), parsed.fill);
        files.push_back(parsed.places == 1 ? parsed.before + digits + parsed.after : parsed.before);
    }
    return files;
}

std::filesystem::path data_file(const std::filesystem::path& header, const std::string& name) {
    constexpr std::size_t kLongest = 1024;
    const bool has_control =
        std::ranges::any_of(name, [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f'; });
    if (name.size() > kLongest || has_control)
        throw Error(header.string() + " names a file of pixels that can be none");
    const std::filesystem::path file = header.parent_path() / name;
    std::error_code failure;
    const std::filesystem::file_type type = std::filesystem::status(file, failure).type();
    using enum std::filesystem::file_type;
    if (type == fifo || type == character || type == block || type == socket) {
        throw Error(header.string() + " names " + file.string() + " for its pixels, which is no regular file");
    }
    return file;
}

double files_needed(std::span<const int> size, int dimensions) {
    double files = 1;
    for (std::size_t axis = static_cast<std::size_t>(dimensions); axis < size.size(); ++axis) files *= size[axis];
    return files;
}

void check_file_count(std::size_t named, std::span<const int> size, int dimensions,
                      const std::filesystem::path& where) {
    const double needed = files_needed(size, dimensions);
    if (static_cast<double>(named) == needed) return;
    throw Error(where.string() + " names " + std::to_string(named) + " files of pixels, and the size that it states, " +
                size_text(size) + ", asks for " + number_text(needed));
}

}  // namespace raylign::detail

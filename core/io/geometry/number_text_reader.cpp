#include "core/io/geometry/number_text_reader.h"

#include <cmath>

#include "core/base/error.h"
#include "core/io/files/text.h"
#include "core/io/files/text_file.h"

namespace raylign::detail {
namespace {

/// The parts of a line between commas and blanks; an empty part between two commas stays.
std::vector<std::string_view> parts_of(std::string_view text) {
    const auto is_blank = [](char c) { return c == ' ' || c == '\t'; };
    std::vector<std::string_view> parts;
    if (text.find(',') != std::string_view::npos) {
        if (text.ends_with(',')) text.remove_suffix(1);  // spreadsheets write one
        for (const std::string_view part : split(text, ',')) parts.push_back(trimmed(part));
        return parts;
    }
    for (std::size_t at = 0; at < text.size();) {
        if (is_blank(text[at])) {
            ++at;
            continue;
        }
        std::size_t end = at;
        while (end < text.size() && !is_blank(text[end])) ++end;
        parts.push_back(text.substr(at, end - at));
        at = end;
    }
    return parts;
}

}  // namespace

std::vector<TextLine> text_lines(const std::filesystem::path& path, KeepIndent keep_indent, std::uintmax_t most_bytes) {
    const std::string text = read_text_file(path, most_bytes);
    std::vector<TextLine> lines;
    int number = 0;
    for (const std::string_view line : split(text, '\n')) {
        ++number;
        if (trimmed(line).empty()) continue;
        lines.push_back({number, std::string(keep_indent == KeepIndent::yes ? line : trimmed(line))});
    }
    if (lines.empty()) throw Error(path.string() + " has no text");
    return lines;
}

std::optional<std::vector<double>> number_parts(std::string_view line) {
    std::vector<double> numbers;
    for (const std::string_view part : parts_of(line)) {
        const std::optional<double> number = number_from(part);
        if (!number || !std::isfinite(*number)) return std::nullopt;
        numbers.push_back(*number);
    }
    return numbers;
}

std::vector<double> line_numbers(const TextLine& line, std::size_t count, const std::string& what,
                                 const std::filesystem::path& path) {
    const std::vector<double> numbers = number_parts(line.text).value_or(std::vector<double>());
    if (numbers.size() != count) {
        throw bad_value(what, "\"" + line.text.substr(0, 80) + "\"", std::to_string(count) + " numbers",
                        path.string() + ", line " + std::to_string(line.number));
    }
    return numbers;
}

}  // namespace raylign::detail

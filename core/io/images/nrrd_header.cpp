#include "core/io/images/nrrd_header.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/io/files/text.h"
#include "core/io/images/header_text.h"
#include "core/io/images/stored_pixels.h"

namespace raylign::detail {
namespace {

/// "axis mins" and "axismins" are one field.
std::string field_name(std::string_view text) {
    std::string name = lower_case(trimmed(text));
    std::erase(name, ' ');
    if (name == "centers") return "centerings";
    return name;
}

void take_line(const std::string& line, NrrdHeader& header) {
    if (line.starts_with('#')) return;
    const std::size_t pair = line.find(":="), field = line.find(": ");
    if (pair != std::string::npos && (field == std::string::npos || pair < field)) {
        header.pairs.insert_or_assign(line.substr(0, pair), line.substr(pair + 2));
        return;
    }
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos) {
        throw damaged(header.path, FileFormat::nrrd, "a line of its header is not \"field: value\"");
    }
    const auto [place, is_new] =
        header.fields.emplace(field_name(line.substr(0, colon)), std::string(trimmed(line.substr(colon + 1))));
    if (!is_new) throw Error(header.path.string() + " states \"" + place->first + "\" twice");
}

bool is_list(std::string_view line) {
    const std::size_t colon = line.find(':');
    return colon != std::string_view::npos && field_name(line.substr(0, colon)) == "datafile" &&
           trimmed(line.substr(colon + 1)).starts_with("LIST");
}

/// The numbers of a list of an entry an axis; "nan" is an empty one.
std::vector<std::optional<double>> axis_numbers(const NrrdHeader& header, std::string_view name, std::size_t axes) {
    std::vector<std::optional<double>> numbers(axes);
    const std::vector<std::string_view> words = words_in(header.field(name));
    if (words.empty()) return numbers;
    for (std::size_t i = 0; i < axes; ++i) {
        const std::optional<double> number = i < words.size() ? number_from(words[i]) : std::nullopt;
        if (words.size() != axes || !number || std::isinf(*number)) {
            throw bad_value(name, "\"" + std::string(header.field(name)) + "\"",
                            std::to_string(axes) + " numbers, one an axis", header.path.string());
        }
        if (!std::isnan(*number)) numbers[i] = number;
    }
    return numbers;
}

std::vector<std::string> axis_words(const NrrdHeader& header, std::string_view name, std::size_t axes) {
    std::vector<std::string> words = quoted_words(header.field(name));
    if (words.empty()) words.resize(axes);
    if (words.size() != axes) {
        throw bad_value(name, "\"" + std::string(header.field(name)) + "\"",
                        std::to_string(axes) + " words, one an axis", header.path.string());
    }
    for (std::string& word : words) {
        if (word == "???" || word == "none") word.clear();
    }
    return words;
}

}  // namespace

std::string_view NrrdHeader::field(std::string_view name) const {
    const auto found = fields.find(name);
    return found == fields.end() ? std::string_view() : std::string_view(found->second);
}

std::string_view NrrdHeader::needed(std::string_view name) const {
    const std::string_view text = field(name);
    if (text.empty()) throw damaged(path, FileFormat::nrrd, "its header has no \"" + std::string(name) + "\"");
    return text;
}

bool NrrdAxis::is_range() const {
    constexpr std::array<std::string_view, 4> kInSpace = {"", "domain", "space", "time"};
    return std::ranges::find(kInSpace, kind) == kInSpace.end();
}

std::vector<std::string> quoted_words(std::string_view text) {
    std::vector<std::string> words;
    for (std::size_t at = text.find_first_not_of(" \t"); at < text.size();) {
        const bool is_quoted = text[at] == '"';
        const std::size_t begin = is_quoted ? at + 1 : at;
        const std::size_t end = std::min(text.find_first_of(is_quoted ? "\"" : " \t", begin), text.size());
        words.emplace_back(text.substr(begin, end - begin));
        at = end < text.size() ? text.find_first_not_of(" \t", end + 1) : text.size();
    }
    return words;
}

std::optional<Eigen::VectorXd> nrrd_vector(std::string_view text, int numbers, const NrrdHeader& header) {
    if (text == "none") return std::nullopt;
    Eigen::VectorXd vector(numbers);
    const std::size_t close = text.find(')');
    const std::string_view inside =
        text.starts_with('(') && close != std::string_view::npos ? text.substr(1, close - 1) : std::string_view();
    const std::vector<std::string_view> parts = split(inside, ',');
    bool is_good = static_cast<int>(parts.size()) == numbers;
    for (int i = 0; is_good && i < numbers; ++i) {
        const std::optional<double> number = number_from(parts[static_cast<std::size_t>(i)]);
        is_good = number && !std::isinf(*number);
        vector[i] = number.value_or(0);
    }
    if (!is_good) {
        throw bad_value("vector in space", "\"" + std::string(text.substr(0, 80)) + "\"",
                        std::to_string(numbers) + " numbers as (x,y,z), or none", header.path.string());
    }
    if (vector.array().isNaN().any()) return std::nullopt;
    return vector;
}

NrrdHeader read_nrrd_header(const std::filesystem::path& path) {
    NrrdHeader header{.path = path};
    const HeaderLines head =
        read_header_lines(path, [](std::string_view line) { return line.empty() || is_list(line); });
    header.end = head.end;
    if (head.lines.empty() || !head.lines.front().starts_with("NRRD")) {
        throw damaged(path, FileFormat::nrrd, "it does not begin like one");
    }
    for (std::size_t i = 1; i < head.lines.size(); ++i) {
        if (!head.lines[i].empty()) take_line(head.lines[i], header);
    }
    if (!is_list(head.lines.back())) return header;
    const HeaderLines all = read_header_lines(path, [](std::string_view) { return false; });
    for (std::size_t i = head.lines.size(); i < all.lines.size(); ++i) {
        if (const std::string_view name = trimmed(all.lines[i]); !name.empty()) header.listed.emplace_back(name);
    }
    return header;
}

std::vector<NrrdAxis> nrrd_axes(const NrrdHeader& header, int space_dimensions) {
    const auto count =
        static_cast<std::size_t>(whole_number(header.needed("dimension"), 1, 16, "dimension", header.path));
    const std::vector<std::string_view> sizes = words_in(header.needed("sizes"));
    if (sizes.size() != count) {
        throw bad_value("sizes", "\"" + std::string(header.field("sizes")) + "\"",
                        std::to_string(count) + " numbers, as dimension says", header.path.string());
    }
    const auto spacings = axis_numbers(header, "spacings", count), lows = axis_numbers(header, "axismins", count);
    const auto kinds = axis_words(header, "kinds", count), centres = axis_words(header, "centerings", count),
               units = axis_words(header, "units", count);
    std::vector<NrrdAxis> axes(count);
    for (std::size_t i = 0; i < count; ++i) {
        axes[i].size = whole_number(sizes[i], 1, std::numeric_limits<int>::max(), "sizes", header.path);
        axes[i].kind = lower_case(kinds[i]);
        axes[i].is_cell = centres[i] != "node";
        axes[i].spacing = spacings[i];
        axes[i].low = lows[i];
        axes[i].unit = units[i];
    }
    if (header.field("spacedirections").empty()) return axes;
    std::string_view text = header.field("spacedirections");
    for (NrrdAxis& axis : axes) {  // a vector may hold blanks, so its end is its bracket
        text = trimmed(text);
        const std::size_t end = text.starts_with('(') ? text.find(')') + 1 : std::min(text.find(' '), text.size());
        axis.direction = nrrd_vector(text.substr(0, end == 0 ? text.size() : end), space_dimensions, header);
        text.remove_prefix(end == 0 ? text.size() : std::min(end, text.size()));
        if (!axis.direction && axis.kind.empty()) axis.kind = "list";
    }
    if (!trimmed(text).empty()) {
        throw bad_value("space directions", "\"" + std::string(header.field("spacedirections")) + "\"",
                        "a vector or none, one an axis", header.path.string());
    }
    return axes;
}

}  // namespace raylign::detail

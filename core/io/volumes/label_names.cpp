#include "core/io/volumes/label_names.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/io/files/file_format.h"
#include "core/io/files/text.h"
#include "core/io/images/header_text.h"
#include "core/io/volumes/label_table_text.h"

namespace raylign::detail {
namespace {

std::optional<std::int32_t> label_number(std::string_view text) {
    const std::optional<double> number = number_from(text);
    if (!number || *number != std::round(*number) || !(std::abs(*number) < 2147483648.0)) return std::nullopt;
    return static_cast<std::int32_t>(*number);
}

/// The name of a row between blanks: of a colour table, `1 femur 128 174 128 255`, it ends before its four colours.
std::string_view name_between_blanks(std::string_view row) {
    const std::vector<std::string_view> words = words_in(row);
    if (words.size() < 2) return {};
    std::size_t end = words.size();
    const auto is_number = [](std::string_view word) { return number_from(word).has_value(); };
    if (end >= 6 && std::all_of(words.end() - 4, words.end(), is_number)) end -= 4;
    const char* const last = words[end - 1].data() + words[end - 1].size();
    return {words[1].data(), static_cast<std::size_t>(last - words[1].data())};
}

/// Number and name of a row: by quotes (ITK-SNAP, `1 255 0 0 1 1 1 "femur"`), commas, tabs or blanks.
std::pair<std::string_view, std::string_view> number_and_name(std::string_view row) {
    const std::size_t first = row.find_first_of(",;\t ");
    if (first == std::string_view::npos) return {row, {}};
    const std::string_view number = row.substr(0, first);
    const std::size_t open = row.find('"'), close = row.rfind('"');
    if (open != std::string_view::npos && close > open)
        return {number, trimmed(row.substr(open + 1, close - open - 1))};
    for (const char separator : {',', ';', '\t'}) {
        const std::vector<std::string_view> cells = split(row, separator);
        if (cells.size() >= 2) return {cells[0], trimmed(cells[1])};
    }
    return {number, name_between_blanks(row)};
}

LabelNames parse_table(std::string_view text, const std::string& where) {
    LabelNames names;
    int line_number = 0;
    bool may_be_heading = true;
    for (const std::string_view line : split(text, '\n')) {
        ++line_number;
        const std::string_view row = trimmed(line);
        if (row.empty() || row.starts_with('#')) continue;
        const auto [number_cell, name] = number_and_name(row);
        const std::optional<std::int32_t> number = label_number(number_cell);
        const bool is_heading = may_be_heading && row.find_first_of("0123456789") == std::string_view::npos;
        may_be_heading = false;
        if (is_heading) continue;
        const std::string line_text = "line " + std::to_string(line_number);
        if (!number || name.empty()) {
            throw bad_value(line_text, "\"" + std::string(row.substr(0, 80)) + "\"", "a label's number and its name",
                            where);
        }
        const auto [place, is_new] = names.emplace(*number, name);
        if (!is_new && place->second != name) {
            throw Error(where + " names label " + std::to_string(*number) + " twice: " + place->second + " and " +
                        std::string(name));
        }
    }
    if (names.empty()) throw Error(where + " has no labels");
    return names;
}

}  // namespace

LabelNames label_names_in_xml(std::string_view text) {
    constexpr std::string_view kLabel = "<Label ", kKey = "Key=\"", kBegin = "<![CDATA[", kEnd = "]]>";
    LabelNames names;
    for (std::size_t at = text.find(kLabel); at != std::string_view::npos; at = text.find(kLabel, at + 1)) {
        const std::string_view label = text.substr(at, text.find("</Label>", at) - at);
        const std::size_t key = label.find(kKey), begin = label.find(kBegin), end = label.find(kEnd);
        if (key == std::string_view::npos || begin == std::string_view::npos || end == std::string_view::npos) continue;
        if (end < begin) continue;
        std::int32_t number = 0;
        const std::string_view digits = label.substr(key + kKey.size());
        if (std::from_chars(digits.data(), digits.data() + digits.size(), number).ec != std::errc()) continue;
        const std::string_view name = label.substr(begin + kBegin.size(), end - begin - kBegin.size());
        if (!trimmed(name).empty()) names.emplace(number, trimmed(name));
    }
    return names;
}

LabelNames read_label_names(const std::filesystem::path& path) {
    check_readable_file(path);
    constexpr std::uintmax_t kMost = 16 << 20;
    if (std::filesystem::file_size(path) > kMost) throw Error(path.string() + " is too large for a table of labels");
    std::stringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return parse_table(text.view(), path.string());
}

LabelNames total_segmentator_names() { return parse_table(total_segmentator_table(), "total_segmentator.csv"); }

std::int32_t label_of(const LabelNames& names, std::string_view name, std::string_view source) {
    std::vector<std::string_view> known;
    std::vector<std::int32_t> found;
    for (const auto& [number, known_name] : names) {
        known.push_back(known_name);
        if (lower_case(known_name) == lower_case(name)) found.push_back(number);
    }
    if (found.size() == 1) return found.front();
    if (found.size() > 1) {
        throw Error("label " + std::string(name) + " stands for " + std::to_string(found.front()) + " and " +
                    std::to_string(found.back()) + " in " + std::string(source) + ": give its number");
    }
    const std::string not_one = "label " + std::string(name) + " is not one of " + std::string(source);
    constexpr std::size_t kFew = 6;
    std::vector<std::string_view> near = nearest(name, known);
    const std::string more = near.size() > kFew ? ", ..." : "";
    near.resize(std::min(near.size(), kFew));
    if (!near.empty()) throw Error(not_one + ": did you mean " + joined(near, ", ") + more + "?");
    const std::string few = joined(std::span(known).first(std::min(known.size(), kFew)), ", ");
    throw Error(not_one + ", which has " + std::to_string(names.size()) + " labels" +
                (few.empty() ? "" : ", such as " + few));
}

}  // namespace raylign::detail

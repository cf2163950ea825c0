#include "core/io/files/text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <numeric>

namespace raylign::detail {
namespace {

std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
            diagonal = row[j];
            row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
        }
    }
    return row[b.size()];
}

}  // namespace

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view kBlanks = " \t\r\n\f\v";
    const std::size_t first = text.find_first_not_of(kBlanks);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::optional<double> number_from(std::string_view text) {
    text = trimmed(text);
    if (text.starts_with('+')) text.remove_prefix(1);
    double value = 0;
    const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
    if (result.ec != std::errc() || result.ptr != text.data() + text.size()) return std::nullopt;
    return value;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
    std::vector<std::string_view> parts;
    for (std::size_t begin = 0;;) {
        const std::size_t end = text.find(separator, begin);
        parts.push_back(text.substr(begin, end - begin));
        if (end == std::string_view::npos) return parts;
        begin = end + 1;
    }
}

std::string joined(std::span<const std::string_view> words, std::string_view separator) {
    std::string text;
    for (const std::string_view word : words) {
        if (!text.empty()) text += separator;
        text += word;
    }
    return text;
}

std::string lower_case(std::string_view text) {
    std::string lower(text);
    for (char& c : lower) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    }
    return lower;
}

std::vector<std::string_view> nearest(std::string_view word, std::span<const std::string_view> candidates) {
    std::vector<std::string_view> near;
    std::size_t least = std::max<std::size_t>(2, word.size() / 2);
    for (const std::string_view candidate : candidates) {
        const std::string a = lower_case(word), b = lower_case(candidate);
        // A forgotten unit ("sdd" for "sdd_mm") is the commonest slip.
        const bool begins_alike = !a.empty() && (a.starts_with(b) || b.starts_with(a));
        const std::size_t distance = begins_alike ? 1 : edit_distance(a, b);
        if (distance > least) continue;
        if (distance < least) near.clear();
        near.push_back(candidate);
        least = distance;
    }
    return near;
}

std::string_view closest(std::string_view word, std::span<const std::string_view> candidates) {
    const std::vector<std::string_view> near = nearest(word, candidates);
    return near.empty() ? std::string_view() : near.front();
}

}  // namespace raylign::detail

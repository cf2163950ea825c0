#pragma once

#include <functional>
#include <optional>
#include <sstream>
#include <string>
#include <utility>

namespace raylign::detail {

/// The parts one after the other, numbers as streams write them.
template <class... Parts>
[[nodiscard]] std::string text_of(const Parts&... parts) {
    std::ostringstream stream;
    (stream << ... << parts);
    return stream.str();
}

/// The words with `separator` between them.
template <class Words>
[[nodiscard]] std::string joined(const Words& words, const std::string& separator = ", ") {
    std::string text;
    for (const auto& word : words) {
        if (!text.empty()) text += separator;
        text += word;
    }
    return text;
}

/// The same of what `word_of` makes of each item.
template <class Items, class WordOf>
[[nodiscard]] std::string joined(const Items& items, const WordOf& word_of, const std::string& separator) {
    std::string text;
    for (const auto& item : items) {
        if (!text.empty()) text += separator;
        text += std::invoke(word_of, item);
    }
    return text;
}

/// "NAME=VALUE" in two; none where either would be empty.
[[nodiscard]] inline std::optional<std::pair<std::string, std::string>> name_and_value(const std::string& text) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) return std::nullopt;
    return std::pair{text.substr(0, equals), text.substr(equals + 1)};
}

}  // namespace raylign::detail

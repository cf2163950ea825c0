#pragma once

#include <sstream>
#include <string>

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

}  // namespace raylign::detail

#pragma once

#include <string>

namespace raylign::detail::apps {

/// As printf writes it.
[[nodiscard, gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

inline constexpr int kLabelWidth = 10;

/// "  label     text" and a line feed: a line of a summary. `width`: of the label's column.
[[nodiscard]] std::string line(const std::string& label, const std::string& text, int width = kLabelWidth);

}  // namespace raylign::detail::apps

#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/number_text.h"

namespace raylign::detail {

/// The whole of `text` (blanks around it allowed) as a number, whatever the locale; empty where it is not one.
[[nodiscard]] std::optional<double> number_from(std::string_view text);

[[nodiscard]] std::string_view trimmed(std::string_view text);
[[nodiscard]] std::vector<std::string_view> split(std::string_view text, char separator);
[[nodiscard]] std::string joined(std::span<const std::string_view> words, std::string_view separator);
[[nodiscard]] std::string lower_case(std::string_view text);

/// The candidates with the smallest edit distance to `word` (Levenshtein), in order; none where no one is near enough
/// to be a typo. What begins alike is one edit away.
[[nodiscard]] std::vector<std::string_view> nearest(std::string_view word,
                                                    std::span<const std::string_view> candidates);

/// The first of them, or "" where there is none.
[[nodiscard]] std::string_view closest(std::string_view word, std::span<const std::string_view> candidates);

}  // namespace raylign::detail

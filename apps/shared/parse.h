#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace raylign::detail::apps {

// Values of options as texts. `option` is named in the Error for what is of another form.

/// On the command line 0 stands for the default.
template <class Number>
[[nodiscard]] std::optional<Number> given(Number value) {
    return value == 0 ? std::nullopt : std::optional<Number>(value);
}

/// `count` numbers with commas between them.
[[nodiscard]] std::vector<double> parse_numbers(std::string_view text, std::size_t count, std::string_view option);

/// "4,5,6" or "4" (all three).
[[nodiscard]] Eigen::Vector3d parse_triple(std::string_view text, std::string_view option);

/// Throws Error for anything but a whole number in [0, 2^64).
[[nodiscard]] std::uint64_t parse_seed(std::string_view text);

/// The words between commas, blanks trimmed. Throws Error where one is empty or stands there twice.
[[nodiscard]] std::vector<std::string> parse_list(const std::string& text, const std::string& option);

/// "NAME=VALUE" in two, both not empty. `form`: how the Error shows what is expected.
[[nodiscard]] std::pair<std::string, std::string> split_named(const std::string& argument, std::string_view option,
                                                              std::string_view form = "NAME=VALUE");

/// "true" or "false"; none where the text is empty.
[[nodiscard]] std::optional<bool> parse_truth(std::string_view text, std::string_view option);

/// Throws Error for a value of --noise that is neither 0 nor in [1, 1e9] photons.
void check_photons(double photons);

}  // namespace raylign::detail::apps

#pragma once

#include <string>

namespace raylign::detail {

/// With so many digits after the point, for sentences; the same in every locale.
[[nodiscard]] std::string fixed(double value, int digits);

/// Shortest text that reads back as the same number, whatever the locale: 9, 0.5, 1e-09.
[[nodiscard]] std::string number_text(double value);

}  // namespace raylign::detail

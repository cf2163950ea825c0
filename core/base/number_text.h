#pragma once

#include <string>

namespace raylign::detail {

/// With so many digits after the point, for sentences; the same in every locale.
[[nodiscard]] std::string fixed(double value, int digits);

}  // namespace raylign::detail

#pragma once

#include <optional>
#include <string_view>

namespace raylign::detail {

/// Millimetres per unit of length as image headers spell it ("mm", "cm", "micron", ...); empty for an unknown one.
[[nodiscard]] std::optional<double> mm_per_unit(std::string_view unit);

}  // namespace raylign::detail

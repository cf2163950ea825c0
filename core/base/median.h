#pragma once

#include <algorithm>
#include <vector>

namespace raylign::detail {

/// The middle value, of an even number the upper of the two in the middle. `values` must not be empty.
template <class Number>
[[nodiscard]] Number median(std::vector<Number> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::ranges::nth_element(values, middle);
    return *middle;
}

}  // namespace raylign::detail

#pragma once

#include <string_view>

namespace raylign::detail {

/// total_segmentator.csv as it is in this folder, compiled in.
[[nodiscard]] std::string_view total_segmentator_table();

}  // namespace raylign::detail

#pragma once

#include <string>

namespace raylign::detail {

/// A number as DS has it: at most 16 characters, as many digits as they hold.
[[nodiscard]] std::string decimal_string(double number);

/// 2.25 and a number of 128 bits, made of the text: such UIDs need no root of one's own (DICOM PS3.5, B.2).
[[nodiscard]] std::string uid_of(const std::string& text);

/// The time now in UTC, as strftime writes it.
[[nodiscard]] std::string utc_now(const char* format);

}  // namespace raylign::detail

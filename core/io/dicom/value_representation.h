#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace raylign::detail {

/// Whether these two letters are a value representation of DICOM PS3.5, table 6.2-1.
[[nodiscard]] bool is_value_representation(std::string_view vr);

/// Explicit elements of these have four bytes of length, after two that are reserved.
[[nodiscard]] bool has_long_length(std::string_view vr);

/// The value representation of an element that raylign reads and whose bytes are no text; "" for all others. Files of
/// implicit value representation do not say it.
[[nodiscard]] std::string_view implicit_representation(std::uint32_t tag);

/// A value as text: binary numbers with backslashes between, text without the blanks and zeros at its ends.
[[nodiscard]] std::string value_as_text(std::string_view vr, const std::string& raw, bool is_big_endian);

}  // namespace raylign::detail

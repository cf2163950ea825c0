#pragma once

#include "raylign/error.h"

namespace raylign::detail::apps {

/// What the program ends with on an Error.
[[nodiscard]] constexpr int exit_code_of(ErrorKind kind) noexcept { return kind == ErrorKind::unavailable ? 3 : 2; }

}  // namespace raylign::detail::apps

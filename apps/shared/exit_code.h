#pragma once

#include "raylign/error.h"

namespace raylign::detail::apps {

/// All was done, and standard output could not be written.
inline constexpr int kOutputFailed = 4;

/// What the program ends with on an Error.
[[nodiscard]] constexpr int exit_code_of(ErrorKind kind) noexcept { return kind == ErrorKind::unavailable ? 3 : 2; }

}  // namespace raylign::detail::apps

#pragma once

#include <optional>
#include <string>

#include "core/registration/level/run.h"

namespace raylign::detail {

/// For a whole that correlates weakly: whether it fits on the coarsest level once the contrast of all views, or of one
/// of up to three, is reversed. A wrong polarity is named so before a part is sought for nothing. Says so in words for
/// people; nothing is changed. Throws RunStopped.
[[nodiscard]] std::optional<std::string> reversed_contrast(const Run& run);

}  // namespace raylign::detail

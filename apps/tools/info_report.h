#pragma once

#include <string>
#include <vector>

#include "raylign/backends.h"

namespace raylign::detail::apps {

/// What `raylign info --json` prints.
[[nodiscard]] std::string info_json(const std::vector<BackendStatus>& backends);

}  // namespace raylign::detail::apps

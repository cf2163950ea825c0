#pragma once

#include <filesystem>
#include <vector>

#include "apps/shared/json_text.h"
#include "core/backend.h"
#include "raylign/backends.h"

namespace raylign::detail::apps {

// Parts that the reports share.
[[nodiscard]] Json machine_json();                                                ///< {host, processor, ...}
[[nodiscard]] Json inputs_json(const std::vector<std::filesystem::path>& files);  ///< [{path, sha256}, ...]
[[nodiscard]] Json backend_json(const BackendInfo& info);
[[nodiscard]] Json passed_over_json(const std::vector<BackendStatus>& others);  ///< [{name, reason}, ...]

}  // namespace raylign::detail::apps

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/backend.h"

namespace raylign::detail::apps {

/// Parts that the reports share, as JSON texts in one line.
[[nodiscard]] std::string machine_json();                                                ///< host, processor, ...
[[nodiscard]] std::string inputs_json(const std::vector<std::filesystem::path>& files);  ///< [{path, sha256}, ...]
[[nodiscard]] std::string backend_json(const BackendInfo& info);

}  // namespace raylign::detail::apps

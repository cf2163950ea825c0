#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/shared/invocation.h"
#include "apps/shared/manifest.h"
#include "core/validation/compare.h"

namespace raylign::detail::apps {

/// One run of `compare`, as its reports tell it.
struct CompareRun {
    const Invocation& invocation;
    Comparison comparison;
    std::vector<BackendInfo> backends;  ///< in the order compared, the oracle first
    CompareOptions options;
    std::string simulation;  ///< how missing X-rays were made; "" = none was
    std::vector<std::string> notes;
    std::vector<std::filesystem::path> files;
    InputHashes hashes = {};  ///< of the files
};

/// compare.json, indented.
[[nodiscard]] std::string compare_json(const CompareRun& run);

/// A line a comparison, and the verdict last.
[[nodiscard]] std::string compare_table(const CompareRun& run);

}  // namespace raylign::detail::apps

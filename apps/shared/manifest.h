#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/shared/json_text.h"
#include "core/backend.h"
#include "raylign/backends.h"

namespace raylign::detail::apps {

struct HashedFile {
    std::string path, sha256;
};

/// Inputs of a run. They are hashed as soon as they were read: what becomes of the files during the run is not what
/// came into it.
struct InputHashes {
    std::vector<HashedFile> files;
    double time_s = 0;  ///< what hashing took
};
[[nodiscard]] InputHashes hash_inputs(const std::vector<std::filesystem::path>& files);

// Parts that the reports share.
[[nodiscard]] Json machine_json();                          ///< {host, processor, ...}
[[nodiscard]] Json inputs_json(const InputHashes& hashes);  ///< [{path, sha256}, ...]
[[nodiscard]] Json backend_json(const BackendInfo& info);
/// Of the one that a report is about: what it works with, too, and the better ones that `auto` could not take.
[[nodiscard]] Json backend_json(const BackendInfo& info, const std::vector<BackendStatus>& passed_over);
[[nodiscard]] Json passed_over_json(const std::vector<BackendStatus>& others);  ///< [{name, reason}, ...]

}  // namespace raylign::detail::apps

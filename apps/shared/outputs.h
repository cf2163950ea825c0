#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace raylign::detail::apps {

/// Names of files in the output folder.
[[nodiscard]] inline std::string drr_file_name(const std::string& view) { return "drr_" + view + ".tif"; }

/// Throws Error if writing `names` into `folder` would replace one of the `inputs`.
void refuse_to_overwrite(const std::vector<std::filesystem::path>& inputs, const std::filesystem::path& folder,
                         const std::vector<std::string>& names);

}  // namespace raylign::detail::apps

#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "raylign/view.h"
#include "raylign/volume.h"

namespace raylign::detail::apps {

/// What --saturation says: "auto", "none" (infinite) or a line integral in (0, 100]; none for auto. Throws Error for
/// anything else.
[[nodiscard]] std::optional<double> parse_saturation(const std::string& text);

/// A model of metal: what a detector may see nothing through.
[[nodiscard]] bool is_metal(const std::filesystem::path& file, const Volume& volume);

/// Sets the views' ceilings: as said, or with auto, for metal, each by its image. Metal is compared by what arrives,
/// unless nothing is to saturate. Returns what was decided.
[[nodiscard]] std::vector<std::string> settle_saturation(const std::string& text, bool has_metal,
                                                         std::span<View> views);

}  // namespace raylign::detail::apps

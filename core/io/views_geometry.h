#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/camera.h"
#include "core/io/json_node.h"

namespace raylign::detail {

/// The geometry of one view of views.json, from whichever of the four forms it gives. `image_size_px` stands in for a
/// missing size_px where the form allows that. Assumptions go to `notes`. Throws Error for contradictions and bad
/// numbers.
[[nodiscard]] ViewGeometry read_view_geometry(const JsonNode& view, const std::optional<Eigen::Vector2i>& image_size_px,
                                              std::vector<std::string>& notes);

}  // namespace raylign::detail

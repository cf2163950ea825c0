#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/io/files/json_node.h"
#include "raylign/camera.h"
#include "raylign/io/geometry.h"

namespace raylign::detail {

/// A whole number from 1: a frame, a projection.
[[nodiscard]] int read_count(const JsonNode& node);

/// Whether the view names a geometry file of another tool.
[[nodiscard]] bool has_geometry_file(const JsonNode& view);

/// The geometry of one view of views.json, from whichever of the five forms it gives. `image_size_px` stands in for a
/// missing size_px where the form allows that; `folder` is where a geometry file's name begins. Assumptions go to
/// `notes`. Throws Error for contradictions and bad numbers.
[[nodiscard]] GeometryView read_view_geometry(const JsonNode& view, const std::filesystem::path& folder,
                                              const std::optional<Eigen::Vector2i>& image_size_px,
                                              std::vector<std::string>& notes);

}  // namespace raylign::detail

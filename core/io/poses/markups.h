#pragma once

#include <filesystem>
#include <vector>

#include "raylign/io/landmarks.h"

namespace raylign::detail {

/// 3D Slicer's points with their labels, brought to LPS. A .fcsv without a header line is RAS, as old Slicers wrote it;
/// Markups JSON without coordinateSystem is LPS, its default.
[[nodiscard]] std::vector<Landmark> read_fcsv(const std::filesystem::path& path);
[[nodiscard]] std::vector<Landmark> read_markups(const std::filesystem::path& path);

}  // namespace raylign::detail

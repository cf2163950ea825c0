#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace raylign {

/// A named point of the CT.
struct Landmark {
    std::string name;  ///< "" where the file gives none
    Eigen::Vector3d x_ct_mm = Eigen::Vector3d::Zero();
};

/// A point marked on an image as stored (columns, rows; integers are pixel centres).
struct ImagePoint {
    std::string name;  ///< "" where the file gives none: the order counts
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

/// Reads 3D Slicer's Markups JSON (coordinateSystem LPS or RAS, brought to LPS; points that are not defined are left
/// out), its .fcsv, or CSV lines "name,x,y,z" or "x,y,z" in LPS mm. Throws Error for no points or a name given twice.
[[nodiscard]] std::vector<Landmark> read_landmarks(const std::filesystem::path& path);

/// Reads CSV lines "name,x,y" or "x,y", or JSON {"points_px": {"name": [x, y], ...}} or {"points_px": [[x, y], ...]}.
[[nodiscard]] std::vector<ImagePoint> read_image_points(const std::filesystem::path& path);

}  // namespace raylign

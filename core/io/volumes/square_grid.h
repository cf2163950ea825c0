#pragma once

#include <string>
#include <vector>

#include "raylign/volume.h"

namespace raylign::detail {

/// Checks a grid as a file states it, and makes its axes orthonormal where they are that within 1e-3 (with a note where
/// they are not within 1e-4). Axes further from right angles, up to 45 degrees, stay: such a grid is only for
/// on_square_grid. Throws Error for spacing and origin out of range and for axes that are not of unit length.
void check_and_square(VoxelGrid& grid, const std::string& where, std::vector<std::string>& notes);

/// The grid that on_square_grid puts a volume on.
[[nodiscard]] VoxelGrid square_grid(const VoxelGrid& grid);

/// The volume on a grid with axes at right angles, as tilted CT needs it: the planes of its slices stay, and move
/// within themselves; voxels between are linear, those beyond are 0 (air). Sets a note. A square grid is left as it is.
void on_square_grid(Volume& volume, std::vector<std::string>& notes);
/// The same with the label of the nearest voxel, 0 beyond.
void on_square_grid(LabelMap& map, std::vector<std::string>& notes);

}  // namespace raylign::detail

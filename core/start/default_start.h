#pragma once

#include <span>

#include "raylign/grid.h"
#include "raylign/rigid_transform.h"
#include "raylign/view.h"

namespace raylign {

/// The start where none is given: the CT's centre at the world point nearest to all views' central rays (through the
/// middle of each image), in least squares, patient axes parallel to world axes. Where the rays leave a direction open
/// (one view, or parallel ones) the point nearest to the world's origin is taken, the isocentre of C-arm geometry.
/// Throws Error, asking for --start, where that point is not between a source and its detector.
[[nodiscard]] RigidTransform default_start(const VoxelGrid& grid, std::span<const View> views);

}  // namespace raylign

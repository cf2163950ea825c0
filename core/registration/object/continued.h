#pragma once

#include <span>

#include "core/registration/object/cut_faces.h"

namespace raylign::detail {

/// The volume with the outermost voxels of each cut face repeated outwards by `width_mm`: what was cut off looks more
/// like its neighbour than like air, and no edge stands where the CT ends. Halving may have mixed the outermost plane
/// with the zeros around it: a plane with less than three quarters of the sum of the one before is replaced by that.
/// Every voxel of the volume keeps its place in ct.
[[nodiscard]] Volume continued(const Volume& volume, std::span<const CutFace> faces, double width_mm);

}  // namespace raylign::detail

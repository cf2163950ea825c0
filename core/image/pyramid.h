#pragma once

#include "core/base/for_each.h"
#include "raylign/image.h"
#include "raylign/view.h"
#include "raylign/volume.h"

namespace raylign::detail {

/// Averages 2x2x2 voxels (axes of one voxel stay as they are). Voxel i of the result covers 2i and 2i + 1, so its
/// centre is half a fine spacing further in. Odd sizes are padded with one plane of zeros: the total mass is kept.
[[nodiscard]] Volume half_resolution(const Volume& volume, const ForEach& for_each = in_order);

/// Averages 2x2 pixels weighted by their weights; a last odd row or column is dropped. The camera follows
/// (half_resolution of Camera). The new weight is the mean of the four; what else the view is compared by stays.
[[nodiscard]] View half_resolution(const View& view);

/// The same, so many times.
[[nodiscard]] View halved(const View& view, int times);

}  // namespace raylign::detail

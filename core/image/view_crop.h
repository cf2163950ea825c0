#pragma once

#include "raylign/grid.h"
#include "raylign/view.h"

namespace raylign::detail {

/// Pixels with begin <= pixel < end on both axes.
struct PixelBox {
    Eigen::Vector2i begin = Eigen::Vector2i::Zero(), end = Eigen::Vector2i::Zero();
};

/// The pixels of `box`, which lies inside the image; an empty image stays empty.
[[nodiscard]] Image crop(const Image& image, const PixelBox& box);

/// The pixels of `box` as a view of its own: image and weights cut, the principal point moved, every ray where it was.
/// Throws Error for a box that is empty or reaches beyond the detector.
[[nodiscard]] View crop(const View& view, const PixelBox& box);

/// The pixels that a box in ct reaches at a pose: of its eight corners, widened by `margin_px`, clipped to the
/// detector. The whole detector where a corner lies in the source's plane or behind it, or where nothing is reached.
[[nodiscard]] PixelBox reached_pixels(const ViewGeometry& view, const VoxelGrid& grid,
                                      const RigidTransform& world_from_ct, int margin_px);

}  // namespace raylign::detail

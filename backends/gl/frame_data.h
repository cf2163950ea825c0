#pragma once

#include <Eigen/Core>

#include "backends/gl/shared.h"
#include "core/geometry/ray_frame.h"

namespace raylign::detail::gl {

/// What a frame is computed with: the view's size and the part of the volume that is on the device.
struct FrameContext {
    Eigen::Vector2i size_px;
    Eigen::Vector3i first_voxel, size_voxels;
};

/// A RayFrame in floats, taken at the depth where the ray of the image's centre is nearest to the volume's: there
/// positions are small numbers, and what rounding leaves is 1e-5 voxel instead of 1e-3.
[[nodiscard]] shared::FrameData frame_data(const RayFrame& frame, const FrameContext& context);
[[nodiscard]] shared::DerivativeData derivative_data(const RayFrame& frame, const RayFrameDerivatives& derivatives,
                                                     const FrameContext& context);

/// Which axes may be the dominant one of some ray of the image: bit 0 for x. At most a few too many.
[[nodiscard]] unsigned axes_met(const RayFrame& frame, const Eigen::Vector2i& size_px);

}  // namespace raylign::detail::gl

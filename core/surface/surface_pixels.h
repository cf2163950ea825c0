#pragma once

#include "core/surface/surface_rays.h"

namespace raylign::detail {

/// From the rays of a band to what its pixels show.
struct SurfacePixels {
    const SurfaceProjection& seen;
    const RayFrame& frame;
    const Eigen::Vector3d& spacing_mm;
    const SurfaceRays& rays;

    void draw(const DrrTarget& target) const;
    void draw(const RayFrameDerivatives& derivatives, const DrrTarget& target) const;
};

}  // namespace raylign::detail

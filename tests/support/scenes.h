#pragma once

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "raylign/camera.h"
#include "raylign/phantom.h"
#include "raylign/simulate.h"
#include "raylign/view.h"

namespace raylign::detail::test {

/// A C-arm view of `side_px`^2 pixels over a field of about `field_mm` at the isocentre.
inline ViewGeometry c_arm_view(double primary_angle_deg, int side_px, double field_mm = 200,
                               double secondary_angle_deg = 0) {
    const double pitch_mm = 1.5 * field_mm / side_px;
    return view_from_c_arm({.sad_mm = 1000,
                            .sdd_mm = 1500,
                            .primary_angle_deg = primary_angle_deg,
                            .secondary_angle_deg = secondary_angle_deg,
                            .pixel_pitch_mm = {pitch_mm, pitch_mm},
                            .size_px = {side_px, side_px}});
}

/// Frontal and lateral views without images.
inline std::vector<View> biplane_views(int side_px, double field_mm = 200) {
    return {{"AP", c_arm_view(0, side_px, field_mm), {}, {}}, {"LAT", c_arm_view(90, side_px, field_mm), {}, {}}};
}

/// A pose away from every symmetry of grid and cameras: 7 degrees about an oblique axis and a few mm.
inline RigidTransform oblique_pose() {
    Twist twist;
    twist << 0.07, -0.08, 0.06, 3.3, -4.1, 2.2;
    return exp(twist);
}

/// The spine as a volume of n^3 voxels filling 160 mm.
inline Volume spine_volume(int n) {
    return voxelise(spine_phantom({160, 160, 160}), centred_grid({n, n, n}, Eigen::Vector3d::Constant(160.0 / n)), 2);
}

/// Views with the phantom's exact X-rays at `world_from_ct`, with photon noise where photons > 0.
inline std::vector<View> with_exact_images(std::vector<View> views, const Phantom& phantom,
                                           const RigidTransform& world_from_ct, double photons = 0) {
    for (std::size_t v = 0; v < views.size(); ++v) {
        views[v].image = exact_drr(phantom, views[v].geometry, world_from_ct);
        if (photons > 0) views[v].image = with_photon_noise(views[v].image, photons, 100 + v);
    }
    return views;
}

}  // namespace raylign::detail::test

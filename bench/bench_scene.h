#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "raylign/backends.h"
#include "tests/support/scenes.h"

namespace raylign::detail::bench {

/// The spine phantom in n^3 voxels and its two X-rays in side_px^2 pixels, at an oblique pose: the scene of the tests,
/// larger.
struct BenchScene {
    Volume volume;
    std::vector<View> views;
    RigidTransform truth;
    Phantom phantom;
};

inline BenchScene make_scene(int n, int side_px) {
    BenchScene scene{.truth = test::oblique_pose(), .phantom = spine_phantom({160, 160, 160})};
    scene.volume = voxelise(scene.phantom, centred_grid({n, n, n}, Eigen::Vector3d::Constant(160.0 / n)), 2);
    scene.views = test::with_exact_images(test::biplane_views(side_px), scene.phantom, scene.truth, 50000);
    return scene;
}

/// `count` poses around the truth, up to +-10 degrees and +-10 mm per axis: no two views alike, no lucky axis.
inline std::vector<RigidTransform> poses_around(const RigidTransform& truth, int count) {
    Random random(7);
    std::vector<RigidTransform> poses;
    for (int i = 0; i < count; ++i) {
        Twist twist;
        for (int k = 0; k < 6; ++k) twist[k] = random.uniform(-1, 1) * (k < 3 ? 0.17 : 10);
        poses.push_back(exp(twist) * truth);
    }
    return poses;
}

}  // namespace raylign::detail::bench

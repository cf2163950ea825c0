#pragma once

#include <memory>
#include <vector>

#include "backends/gl/devices.h"
#include "backends/gl/gl_session.h"
#include "backends/gl/with_api.h"
#include "tests/support/as_hardware.h"
#include "tests/support/backends.h"
#include "tests/support/scenes.h"

namespace raylign::detail::test {

/// A small biplane scene of the spine, and poses near the truth.
struct SpineScene {
    explicit SpineScene(int volume_voxels = 24, int side_px = 33)
        : volume(spine_volume(volume_voxels)),
          views(with_exact_images(biplane_views(side_px), spine_phantom({160, 160, 160}), oblique_pose())) {}

    [[nodiscard]] Scene scene(Projector projector = Projector::joseph, Metric metric = Metric::gc) const {
        return {volume, views, {projector, {}}, {metric, {1.5, 4}}};
    }
    [[nodiscard]] static std::vector<RigidTransform> poses(int count) {
        std::vector<RigidTransform> list;
        for (int i = 0; i < count; ++i) {
            const Twist twist = (Twist() << 0.03 * i, -0.02 * i, 0.01, 1.5 * i, -0.7 * i, 0.4).finished();
            list.push_back(exp(twist) * oblique_pose());
        }
        return list;
    }

    Volume volume;
    std::vector<View> views;
};

inline std::vector<double> costs(Session& session, const std::vector<RigidTransform>& poses) {
    std::vector<double> result(poses.size(), -1);
    session.evaluate(poses, result);
    return result;
}

}  // namespace raylign::detail::test

/// Makes `api` the functions of OpenGL and checks that a device works; skips with the reason where none does, or fails
/// where gl is required.
#define RAYLIGN_NEED_GL(api)                                                                        \
    raylign::detail::gl::Api api;                                                                   \
    try {                                                                                           \
        api = raylign::detail::test::load_api();                                                    \
        (void)raylign::detail::gl::open_device(api, {});                                            \
    } catch (const raylign::Error& error) {                                                         \
        if (raylign::detail::test::is_required("gl")) FAIL() << "gl is required: " << error.what(); \
        GTEST_SKIP() << error.what();                                                               \
    }

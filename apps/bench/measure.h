#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "raylign/phantom.h"
#include "raylign/registration.h"

namespace raylign::detail::apps {

/// What is timed: a volume and its X-rays at a known pose.
struct BenchScene {
    std::string name;
    Volume volume;
    std::vector<View> views;
    RigidTransform true_world_from_ct;
};

/// The spine phantom, n^3 voxels over 160 mm, and `views` C-arm views around it of side_px^2 pixels: exact X-rays with
/// photon noise.
[[nodiscard]] BenchScene phantom_scene(int n, int side_px, int views);
/// A CT in the middle of the same views, X-rays simulated by another projector, with photon noise.
[[nodiscard]] BenchScene ct_scene(Volume volume, int side_px, int views, const std::string& name);

struct BenchRegistration {
    std::string backend, method;
    bool ok = false;
    std::string problem;  ///< empty if ok
    SessionTiming timing;
    double optimizer_s = 0, total_s = 0;  ///< medians over the repetitions, stages those of the median run
    int iterations = 0;
    std::uint64_t evaluations = 0, linearizations = 0, bytes_to_host = 0;
    std::size_t engine_volume_bytes = 0;
    double initial_mtre_mm = 0, final_mtre_mm = 0;
};
/// The same registration `repeats` times; the run of median time. A result half a voxel or more from the truth is not
/// ok: a fast wrong answer is no result.
[[nodiscard]] BenchRegistration time_registration(const BenchScene& scene, Backend& backend, Method method,
                                                  int repeats);

struct BenchPoint {
    double pose_ms = 0;    ///< wall time of evaluate per pose, all views; median
    double spread_ms = 0;  ///< 75th less 25th percentile
    double rays = 0;       ///< per pose, all views
    std::size_t engine_volume_bytes = 0;
};
/// Poses around the truth, `batch` at once, warm, until `repeats` rounds are done.
[[nodiscard]] BenchPoint time_poses(const BenchScene& scene, Backend& backend, int batch, int repeats);

}  // namespace raylign::detail::apps

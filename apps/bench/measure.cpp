#include "apps/bench/measure.h"

#include <algorithm>
#include <cmath>

#include "apps/shared/interrupt.h"
#include "apps/shared/simulated_views.h"
#include "core/base/clock.h"
#include "core/base/error.h"
#include "core/base/random.h"
#include "raylign/simulate.h"
#include "raylign/statistics.h"
#include "raylign/targets.h"

namespace raylign::detail::apps {
namespace {

constexpr double kPhantomSide_mm = 160;
constexpr double kPhotons = 50000;
constexpr double kStartMtre_mm = 8;

/// A pose that lies away from every symmetry of grid and cameras.
RigidTransform oblique_pose() {
    Twist twist;
    twist << 0.07, -0.08, 0.06, 3.3, -4.1, 2.2;
    return exp(twist);
}

std::vector<View> c_arm_views(int count, int side_px, double field_mm) {
    std::vector<View> views;
    const double pitch_mm = 1.5 * field_mm / side_px;
    for (int v = 0; v < count; ++v) {
        const double angle_deg = count == 1 ? 0 : 180.0 * v / count;  // two views: 0 and 90
        views.push_back({"view" + std::to_string(v + 1),
                         view_from_c_arm({.sad_mm = 1000,
                                          .sdd_mm = 1500,
                                          .primary_angle_deg = angle_deg,
                                          .secondary_angle_deg = 0,
                                          .pixel_pitch_mm = {pitch_mm, pitch_mm},
                                          .size_px = {side_px, side_px}}),
                         {},
                         {}});
    }
    return views;
}

void add_noise(std::vector<View>& views) {
    for (std::size_t v = 0; v < views.size(); ++v) {
        views[v].image = with_photon_noise(views[v].image, kPhotons, 100 + v);
    }
}

std::vector<RigidTransform> poses_around(const RigidTransform& truth, int count) {
    Random random(7);
    std::vector<RigidTransform> poses;
    for (int i = 0; i < count; ++i) {
        Twist twist;
        for (int k = 0; k < 6; ++k) twist[k] = random.uniform(-1, 1) * (k < 3 ? 0.17 : 10);
        poses.push_back(exp(twist) * truth);
    }
    return poses;
}

}  // namespace

BenchScene phantom_scene(int n, int side_px, int views) {
    const Phantom phantom = spine_phantom(Eigen::Vector3d::Constant(kPhantomSide_mm));
    BenchScene scene{"spine phantom", {}, c_arm_views(views, side_px, 200), oblique_pose()};
    scene.volume = voxelise(phantom, centred_grid({n, n, n}, Eigen::Vector3d::Constant(kPhantomSide_mm / n)), 2);
    for (View& view : scene.views) view.image = exact_drr(phantom, view.geometry, scene.true_world_from_ct);
    add_noise(scene.views);
    return scene;
}

BenchScene ct_scene(Volume volume, int side_px, int views, const std::string& name) {
    const Eigen::Vector3d extent_mm = volume.grid.size.cast<double>().cwiseProduct(volume.grid.spacing_mm);
    BenchScene scene{name, std::move(volume), c_arm_views(views, side_px, extent_mm.maxCoeff()), {}};
    scene.true_world_from_ct = oblique_pose() * RigidTransform::translate(-scene.volume.grid.centre_ct_mm());
    (void)simulate_missing_images(scene.volume, scene.views, scene.true_world_from_ct, Projector::joseph);
    add_noise(scene.views);
    return scene;
}

BenchRegistration time_registration(const BenchScene& scene, Backend& backend, Method method, int repeats) {
    BenchRegistration bench{.backend = backend.info().name, .method = std::string(method_name(method))};
    const auto targets = default_targets_ct_mm(scene.volume);
    const RigidTransform start = perturbed_start(scene.true_world_from_ct, targets, kStartMtre_mm, 1);
    RegistrationOptions options{.method = method};
    options.suspect_mirrored = false;
    std::vector<RegistrationResult> runs;
    try {
        for (int i = 0; i < repeats; ++i) {
            runs.push_back(
                register_volume(scene.volume, scene.views, start, options, backend, {.stop = interrupt_token()}));
            stop_if_interrupted();
        }
    } catch (const Error& error) {
        bench.problem = error.what();
        return bench;
    }
    std::ranges::sort(runs, {}, &RegistrationResult::total_s);
    const RegistrationResult& run = runs[runs.size() / 2];
    bench.timing = run.timing;
    bench.optimizer_s = run.optimizer_s;
    bench.total_s = run.total_s;
    bench.iterations = run.iterations;
    bench.evaluations = run.counters.evaluations;
    bench.linearizations = run.counters.linearizations;
    bench.bytes_to_host = run.counters.bytes_to_host;
    for (const LevelReport& level : run.levels) {
        bench.engine_volume_bytes = std::max(bench.engine_volume_bytes, level.volume_bytes);
    }
    bench.initial_mtre_mm = kStartMtre_mm;
    bench.final_mtre_mm = mean_target_error_mm(run.world_from_ct, scene.true_world_from_ct, targets);
    const double limit_mm = scene.volume.grid.spacing_mm.minCoeff() / 2;
    bench.ok = bench.final_mtre_mm < limit_mm || (scene.views.size() == 1 && bench.final_mtre_mm < 1);
    if (!bench.ok) {
        bench.problem = "ended " + std::to_string(bench.final_mtre_mm) + " mm from the truth (half a voxel is " +
                        std::to_string(limit_mm) + " mm)";
    }
    return bench;
}

BenchPoint time_poses(const BenchScene& scene, Backend& backend, int batch, int repeats) {
    const auto session = backend.prepare({scene.volume, scene.views, {}, {}});
    const std::vector<RigidTransform> poses = poses_around(scene.true_world_from_ct, batch);
    std::vector<double> costs(poses.size()), ms;
    session->evaluate(poses, costs);  // warms up: makes the layouts, touches code and data
    for (int i = 0; i < repeats; ++i) {
        stop_if_interrupted();
        const auto begin = Clock::now();
        session->evaluate(poses, costs);
        ms.push_back(1e3 * seconds_since(begin) / batch);
        if (std::ranges::any_of(costs, [](double c) { return !(c > 0 && c < 2); })) {
            throw Error("a wrong cost while timing " + backend.info().name + ": a fast wrong answer is not a result");
        }
    }
    BenchPoint point{percentile(ms, 0.5), percentile(ms, 0.75) - percentile(ms, 0.25), 0, session->volume_bytes()};
    for (const View& view : scene.views) {
        point.rays += static_cast<double>(view.geometry.camera.size_px.x()) * view.geometry.camera.size_px.y();
    }
    return point;
}

}  // namespace raylign::detail::apps

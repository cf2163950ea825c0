// Views that contradict each other: whether the verdict notices cameras that are believed elsewhere, whether it doubts
// right ones, and what --refine-views finds. X-rays are simulated from the CT by the other projector (trilinear, 0.4
// voxel steps) with the true cameras; the last camera is then turned or moved about the object's centre, and both are
// registered with that. Usage:
//   raylign_views CT [scenes=noise] [errors=0] [trials=10] [angles_deg=90] [plain|refined=plain] [pixels=256]
//                 [--json FILE]
// Scenes: noise, scatter, metal, truncated (the CT lacks its lower and upper fifth), commas between several.
// Errors: degrees, or millimetres with "mm", about and along an axis drawn for each trial. RAYLIGN_LIST=1 prints every
// trial.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "bench/program.h"
#include "bench/record.h"
#include "bench/robustness_scene.h"
#include "core/base/error.h"
#include "core/base/random.h"
#include "core/evaluation/mismatch.h"
#include "core/image/region.h"
#include "core/registration/object/pose_space.h"
#include "raylign/backends.h"
#include "raylign/io/volume.h"
#include "raylign/registration.h"
#include "raylign/simulate.h"
#include "raylign/targets.h"
#include "tests/support/scenes.h"

namespace raylign::detail::bench {
namespace {

constexpr double kCountedPhotons = 20000, kShown_mm = 400;

struct ViewScene {
    std::string name;
    Volume moving;
    std::vector<View> views;
    std::vector<Image> clean;  ///< of each view, before noise: that differs from trial to trial
    std::vector<Eigen::Vector3d> targets;
    RigidTransform truth;
    Eigen::Vector3d centre_world_mm = Eigen::Vector3d::Zero();
};

ViewScene make_view_scene(const std::string& name, const Volume& ct, double angle_deg, int pixels) {
    if (name != "noise" && name != "scatter" && name != "metal" && name != "truncated") {
        throw bad_value("scene", name, "noise, scatter, metal or truncated");
    }
    ViewScene scene{.name = name, .moving = ct};
    Volume actual = ct;
    if (name == "metal") put_metal(actual);
    if (name == "truncated") {
        const Eigen::Vector3i n = ct.grid.size;
        scene.moving = crop(ct, {{0, 0, n.z() / 5}, {n.x(), n.y(), n.z() - n.z() / 5}});
    }
    scene.targets = default_targets_ct_mm(scene.moving);
    scene.truth = test::oblique_pose() * RigidTransform::translate(-Eigen::Vector3d(ct.grid.centre_ct_mm()));
    scene.centre_world_mm = scene.truth * object_extent(scene.moving).centre_ct_mm;
    scene.views = {{"AP", test::c_arm_view(0, pixels, kShown_mm), {}, {}},
                   {"LAT", test::c_arm_view(angle_deg, pixels, kShown_mm), {}, {}}};
    const RenderSettings fine{Projector::trilinear, 0.4 * ct.grid.spacing_mm.minCoeff()};
    const auto session = create_backend("cpu").backend->prepare({actual, scene.views, fine, {}});
    for (std::size_t v = 0; v < scene.views.size(); ++v) {
        Image image = session->render(scene.truth, v);
        if (name != "noise") image = with_scatter(image, 0.3, pixels / 10.0);
        scene.clean.push_back(std::move(image));
    }
    return scene;
}

/// "1.5" degrees or "10mm".
struct CameraError {
    double degrees = 0, mm = 0;
};

CameraError camera_error(const std::string& text) {
    const double value = std::strtod(text.c_str(), nullptr);
    return text.ends_with("mm") ? CameraError{0, value} : CameraError{value, 0};
}

struct Trial {
    double final_mm = 0, found_error_sigma = 0;
    Twist camera;  ///< by which the last camera must be moved to be right
    RegistrationResult found;
};

Trial run_trial(const ViewScene& scene, const CameraError& error, std::uint64_t seed, bool refined, Backend& backend) {
    Random random(seed);
    Trial trial;
    std::vector<View> views = scene.views;
    for (std::size_t v = 0; v < views.size(); ++v) {
        views[v].image = with_photon_noise(scene.clean[v], kCountedPhotons, 1000 * seed + v);
    }
    const Eigen::Vector3d axis = random.direction();
    trial.camera << axis * error.degrees * std::numbers::pi / 180, axis * error.mm;
    RigidTransform& believed = views.back().geometry.camera_from_world;
    believed = believed * exp_about(trial.camera, scene.centre_world_mm);
    const RigidTransform start = perturbed_start(scene.truth, scene.targets, random.uniform(0, 15), seed);
    RegistrationOptions options;
    if (refined) options.refine_views.emplace();
    trial.found = register_volume(scene.moving, views, start, options, backend);
    trial.final_mm = mean_target_error_mm(trial.found.world_from_ct, scene.truth, scene.targets);
    const ViewCorrection& correction = trial.found.views.back().correction;
    double squared = 0;
    for (int i = 0; i < 3; ++i) {
        const double turn_deg = correction.rotation_deg[i] - trial.camera[i] * 180 / std::numbers::pi;
        squared += std::pow(turn_deg / correction.rotation_sigma_deg[i], 2);
        squared +=
            std::pow((correction.translation_mm[i] - trial.camera[i + 3]) / correction.translation_sigma_mm[i], 2);
    }
    trial.found_error_sigma = std::sqrt(squared / 6);
    return trial;
}

std::string text_of(const Eigen::Vector3d& v) {
    char text[64];
    std::snprintf(text, sizeof text, "%+.2f %+.2f %+.2f", v.x(), v.y(), v.z());
    return text;
}

void list_trial(int number, const Trial& trial) {
    const ViewCorrection& c = trial.found.views.back().correction;
    std::printf(
        "  %3d mTRE %6.3f expected %.3f significance %6.2f effect %.3f | true %s deg %s mm | found %s (%s) deg, %s "
        "(%s) "
        "mm, off %.2f sigma | %.2f s %s%s\n",
        number, trial.final_mm, trial.found.confidence.rim_mm, c.significance, c.effect_mm,
        text_of(trial.camera.head<3>() * 180 / std::numbers::pi).c_str(), text_of(trial.camera.tail<3>()).c_str(),
        text_of(c.rotation_deg).c_str(), text_of(c.rotation_sigma_deg).c_str(), text_of(c.translation_mm).c_str(),
        text_of(c.translation_sigma_mm).c_str(), trial.found_error_sigma, trial.found.total_s,
        trial.found.ok ? "ok" : "doubtful: ", trial.found.ok ? "" : trial.found.reasons.front().c_str());
}

double percentile(std::vector<double> values, double p) {
    std::ranges::sort(values);
    return values[std::min(values.size() - 1, static_cast<std::size_t>(p * static_cast<double>(values.size())))];
}

void print_row(const ViewScene& scene, const std::string& error, double angle_deg, int trials, bool refined,
               Backend& backend, Record& record) {
    int doubted = 0, contradicting = 0;
    std::vector<double> final_mm, significance, effect_mm, off_sigma, seconds;
    for (int number = 0; number < trials; ++number) {
        const Trial trial = run_trial(scene, camera_error(error), 1 + number, refined, backend);
        const ViewCorrection& correction = trial.found.views.back().correction;
        doubted += !trial.found.ok;
        contradicting += correction.is_doubtful;
        final_mm.push_back(trial.final_mm);
        significance.push_back(correction.significance);
        effect_mm.push_back(correction.effect_mm);
        off_sigma.push_back(trial.found_error_sigma);
        seconds.push_back(trial.found.total_s);
        if (std::getenv("RAYLIGN_LIST")) list_trial(number, trial);
    }
    std::printf(
        "%-10s %3.0f deg %-7s camera off by %-5s mTRE p50 %.3f max %.3f  significance p50 %.2f max %.2f  effect p50 "
        "%.3f "
        "max %.3f mm  correction off by %.2f sigma (max %.2f)  contradicting %d doubtful %d of %d  %.2f s\n",
        scene.name.c_str(), angle_deg, refined ? "refined" : "plain", error.c_str(), percentile(final_mm, 0.5),
        percentile(final_mm, 1), percentile(significance, 0.5), percentile(significance, 1), percentile(effect_mm, 0.5),
        percentile(effect_mm, 1), percentile(off_sigma, 0.5), percentile(off_sigma, 1), contradicting, doubted, trials,
        percentile(seconds, 0.5));
    std::fflush(stdout);
    record.add({scene.name, angle_deg, error, refined ? "refined" : "plain", percentile(final_mm, 0.5),
                percentile(final_mm, 1), percentile(significance, 0.5), percentile(significance, 1),
                percentile(off_sigma, 0.5), contradicting, doubted, trials, percentile(seconds, 0.5)});
}

std::vector<std::string> split(const std::string& text) {
    std::vector<std::string> parts;
    std::stringstream list(text);
    for (std::string part; std::getline(list, part, ',');) parts.push_back(part);
    return parts;
}

int run(int argc, char** argv, Record& record) {
    const auto word = [&](int i, const char* fallback) { return std::string(argc > i ? argv[i] : fallback); };
    const Volume ct = read_volume(argv[1]).volume;
    const auto backend = create_backend("cpu").backend;
    for (const std::string& name : split(word(2, "noise"))) {
        for (const std::string& angle : split(word(5, "90"))) {
            const double angle_deg = std::atof(angle.c_str());
            const ViewScene scene = make_view_scene(name, ct, angle_deg, std::atoi(word(7, "256").c_str()));
            for (const std::string& way : split(word(6, "plain"))) {
                for (const std::string& error : split(word(3, "0"))) {
                    print_row(scene, error, angle_deg, std::atoi(word(4, "10").c_str()), way == "refined", *backend,
                              record);
                }
            }
        }
    }
    record.note("X-rays simulated from the CT");
    record.write();
    return 0;
}

}  // namespace
}  // namespace raylign::detail::bench

int main(int argc, char** argv) {
    if (argc < 2) {
        std::fprintf(stderr,
                     "usage: raylign_views CT [scenes] [errors] [trials] [angles_deg] [plain|refined] [pixels]\n");
        return 2;
    }
    return raylign::detail::bench::run_program("raylign_views", [&] {
        raylign::detail::bench::Record record(
            argc, argv, "Views that contradict each other",
            {"scene", "views apart [deg]", "camera off by", "cameras", "mTRE, p50 [mm]", "mTRE, max [mm]",
             "significance, p50", "significance, max", "correction off by [sigma], p50", "said to contradict",
             "doubtful", "of", "time, median [s]"});
        return raylign::detail::bench::run(argc, argv, record);
    });
}

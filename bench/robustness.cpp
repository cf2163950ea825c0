// How far registration reaches, and whether it knows when it failed: success by initial error in scenes that the CT
// explains less and less. X-rays are simulated by the other projector (trilinear, 0.4 voxel steps) from a volume that
// differs from the CT as the scene says. Usage:
//   raylign_robustness CT [scenes=noise] [intervals_mm=0:20,20:40,40:60] [trials=50] [views=2] [variants=auto]
//                      [pixels=256] [--json FILE]
// Several scenes, intervals or variants stand between commas. RAYLIGN_LIST=1 prints every trial.
// Scenes:
//   clean, noise, scatter, metal
//   vertebra-1 to vertebra-5   lower to upper thoracic; the boxes are for the chest CT of the tests
//   spine                      the third vertebra of the spine phantom, cut exactly, in the X-ray of all of it
// Variants:
//   auto, no-robust, one-level, no-search, steepest-descent, bobyqa
//   part                       as part, without a search
//   global                     without a start: turned by up to 40 degrees and anywhere in view
// The columns of the verdict count the failures that it doubted, and the successes that it doubted.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bench/record.h"
#include "core/base/error.h"
#include "core/base/random.h"
#include "core/evaluation/mismatch.h"
#include "core/image/region.h"
#include "raylign/backends.h"
#include "raylign/io/volume.h"
#include "raylign/registration.h"
#include "raylign/simulate.h"
#include "raylign/targets.h"
#include "tests/support/scenes.h"

namespace raylign::detail::bench {
namespace {

/// Photons that an empty pixel counts. Through 300 mm of chest 1 in 1000 comes out.
constexpr double kPhotons = 20000, kPhotonsPart = 1e6, kField_mm = 400;
constexpr float kBone_per_mm = 0.0237F;  // 150 HU

struct Scene {
    std::string name;
    Volume moving;  ///< what is registered
    std::vector<View> views;
    std::vector<Eigen::Vector3d> targets;
    RigidTransform truth;
    double success_mm = 0;
};

/// Two rods with screws behind the thoracic spine, other contrast, and water where the CT shows lung.
void put_metal(Volume& actual) {
    const Eigen::Vector3d n = actual.grid.size.cast<double>();
    const auto at = [&](double x, double y, double z) {
        return actual.grid.ct_from_voxel({x * n.x(), y * n.y(), z * n.z()});
    };
    change_contrast(actual, {.soft_gain = 0.92, .bone_gain = 1.3});
    for (const double x : {0.44, 0.51}) {
        add_rod(actual, {at(x, 0.79, 0.15), at(x, 0.77, 0.6)});
        for (double z = 0.2; z < 0.6; z += 0.12)
            add_rod(actual, {at(x, 0.79, z), at(0.475 + (x - 0.475) * 0.5, 0.7, z), 3});
    }
    add_rod(actual, {at(0.3, 0.6, 0.3), at(0.3, 0.65, 0.3), 35, 0.0205});
}

/// As `--object voxels:... --bone-threshold 150` reads it.
Volume vertebra(const Volume& ct, const VoxelBox& box) {
    Volume bone = crop(ct, box);
    contrast_above(bone, kBone_per_mm);
    fade_sides(bone, 4);
    return bone;
}

/// Exact X-rays of the spine phantom; one of its vertebrae is registered.
Scene make_spine(int view_count, int pixels) {
    const Eigen::Vector3d extent_mm = Eigen::Vector3d::Constant(200);
    Scene scene{.name = "spine",
                .moving = voxelise(spine_vertebra(extent_mm, 2), centred_grid({200, 200, 200}, {1, 1, 1}), 3),
                .views = test::biplane_views(pixels, 300),
                .truth = test::oblique_pose(),
                .success_mm = 2};
    scene.targets = default_targets_ct_mm(scene.moving);
    scene.views.resize(view_count);
    const Phantom spine = spine_phantom(extent_mm);
    for (std::size_t v = 0; v < scene.views.size(); ++v) {
        const Image image = exact_drr(spine, scene.views[v].geometry, scene.truth);
        scene.views[v].image = with_photon_noise(with_scatter(image, 0.3, pixels / 10.0), kPhotonsPart, 100 + v);
    }
    return scene;
}

Scene make_scene(const std::string& name, const Volume& ct, int view_count, int pixels) {
    if (name == "spine") return make_spine(view_count, pixels);
    Scene scene{.name = name, .moving = ct};
    Volume actual = ct;
    if (name == "metal") put_metal(actual);
    static constexpr std::array<std::pair<std::string_view, std::array<int, 2>>, 5> kVertebrae{
        {{"vertebra-1", {28, 43}},
         {"vertebra-2", {39, 53}},
         {"vertebra-3", {49, 63}},
         {"vertebra-4", {60, 73}},
         {"vertebra-5", {70, 83}}}};
    for (const auto& [vertebra_name, z] : kVertebrae) {
        if (name == vertebra_name) scene.moving = vertebra(ct, {{100, 165, z[0]}, {140, 218, z[1]}});
    }
    const bool part = scene.moving.grid.size != ct.grid.size;
    if (!part && name != "clean" && name != "noise" && name != "scatter" && name != "metal") {
        throw bad_value("scene", name, "clean, noise, scatter, metal, vertebra-1 to vertebra-5 or spine");
    }
    scene.targets = default_targets_ct_mm(scene.moving);
    const Eigen::Vector3d centre = part ? targets_centre_mm(scene.targets) : Eigen::Vector3d(ct.grid.centre_ct_mm());
    scene.truth = test::oblique_pose() * RigidTransform::translate(-centre);
    scene.success_mm = part ? 2 : ct.grid.spacing_mm.minCoeff() / 2;
    scene.views = test::biplane_views(pixels, part ? 300 : kField_mm);
    scene.views.resize(view_count);
    const RenderSettings fine{Projector::trilinear, 0.4 * ct.grid.spacing_mm.minCoeff()};
    const auto session = create_backend("cpu").backend->prepare({actual, scene.views, fine, {}});
    for (std::size_t v = 0; v < scene.views.size(); ++v) {
        Image image = session->render(scene.truth, v);
        if (name == "scatter" || name == "metal" || part) image = with_scatter(image, 0.3, pixels / 10.0);
        if (name != "clean") image = with_photon_noise(image, part ? kPhotonsPart : kPhotons, 100 + v);
        scene.views[v].image = std::move(image);
    }
    return scene;
}

struct Trial {
    double initial_mm = 0, final_mm = 0;
    bool success = false;
    RegistrationResult found;
};

double percentile(std::vector<double> values, double p) {
    std::ranges::sort(values);
    return values[std::min(values.size() - 1, static_cast<std::size_t>(p * static_cast<double>(values.size())))];
}

RegistrationOptions options_of(const std::string& variant) {
    RegistrationOptions options;
    if (variant == "no-robust") {
        options.robust = false;
    } else if (variant == "one-level") {
        options.levels = 1;
    } else if (variant == "no-search") {
        options.search.mode = Search::none;
    } else if (variant == "part") {
        options.content = Content::part;
        options.search.mode = Search::none;
    } else if (variant == "global") {
        options.search.mode = Search::global;
    } else {
        options.method = method_from_name(variant);
    }
    return options;
}

/// A start within the interval; for `global` it is turned by up to 40 degrees and up to 100 mm off along each axis.
RigidTransform start_of(const Scene& scene, const std::string& variant, double initial_mm, std::uint64_t seed) {
    if (variant != "global") return perturbed_start(scene.truth, scene.targets, initial_mm, seed);
    Random random(seed);
    Twist twist;
    twist << 0.7 * std::cbrt(random.uniform()) * random.direction(), random.uniform(-100, 100),
        random.uniform(-100, 100), random.uniform(-100, 100);
    return exp_about(twist, scene.truth * targets_centre_mm(scene.targets)) * scene.truth;
}

Trial run_trial(const Scene& scene, const std::string& variant, double initial_mm, std::uint64_t seed,
                Backend& backend) {
    const RigidTransform start = start_of(scene, variant, initial_mm, seed);
    RegistrationOptions options = options_of(variant);
    options.search.seed = seed;
    Trial trial{.initial_mm = mean_target_error_mm(start, scene.truth, scene.targets),
                .found = register_volume(scene.moving, scene.views, start, options, backend)};
    std::vector<ViewGeometry> geometry;
    for (const View& view : scene.views) geometry.push_back(view.geometry);
    const TargetErrors errors = target_errors(trial.found.world_from_ct, scene.truth, scene.targets, geometry);
    const bool single = scene.views.size() == 1;
    trial.final_mm = single ? errors.mean_mrpd_mm : errors.mtre_mm;
    trial.success = trial.final_mm < (single ? 1 : scene.success_mm);
    return trial;
}

void list_trial(int number, const Trial& trial) {
    const RegistrationResult& found = trial.found;
    const double gap = found.search.rivals.empty() ? 0 : found.search.rivals.front().cost - found.search.cost;
    std::printf(
        "  %3d %s start %6.2f end %8.3f expected %.3f cost %.4f from %.4f agree %d gap %.4f lin %4llu eval %5llu "
        "%5.2f s %s%s\n",
        number, trial.success ? "+" : "-", trial.initial_mm, trial.final_mm, found.confidence.rim_mm, found.cost_final,
        found.cost_initial, found.search.agreeing, gap, static_cast<unsigned long long>(found.counters.linearizations),
        static_cast<unsigned long long>(found.counters.evaluations), found.total_s,
        found.ok ? "ok" : "doubtful: ", found.ok ? "" : found.reasons.front().c_str());
}

void print_interval(const Scene& scene, const std::string& variant, double low_mm, double high_mm, int trials,
                    Backend& backend, Record& record) {
    int successes = 0, caught = 0, doubted = 0, within = 0;
    std::vector<double> final_mm, seconds, linearizations;
    for (int number = 0; number < trials; ++number) {
        const std::uint64_t seed = 1000 * static_cast<std::uint64_t>(high_mm) + number;
        const Trial trial = run_trial(scene, variant, Random(seed).uniform(low_mm, high_mm), seed, backend);
        successes += trial.success;
        caught += !trial.success && !trial.found.ok;
        doubted += trial.success && !trial.found.ok;
        within += trial.success && trial.final_mm < 2 * trial.found.confidence.rim_mm;
        final_mm.push_back(trial.final_mm);
        seconds.push_back(trial.found.total_s);
        linearizations.push_back(static_cast<double>(trial.found.counters.linearizations));
        if (std::getenv("RAYLIGN_LIST")) list_trial(number, trial);
    }
    std::printf(
        "%-11s %-16s %3.0f-%-3.0f %4d/%-4d p50 %6.3f p95 %6.3f max %6.2f mm  %5.2f s (p95 %5.2f) %4.0f lin  "
        "caught %d/%d doubted %d/%d within 2 sigma %d/%d\n",
        scene.name.c_str(), variant.c_str(), low_mm, high_mm, successes, trials, percentile(final_mm, 0.5),
        percentile(final_mm, 0.95), percentile(final_mm, 1), percentile(seconds, 0.5), percentile(seconds, 0.95),
        percentile(linearizations, 0.5), caught, trials - successes, doubted, successes, within, successes);
    std::fflush(stdout);
    record.add({scene.name, variant, scene.views.size(), low_mm, high_mm, successes, trials, percentile(final_mm, 0.5),
                percentile(final_mm, 1), percentile(seconds, 0.5), percentile(linearizations, 0.5), caught, doubted});
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
    const int trials = std::atoi(word(4, "50").c_str()), views = std::atoi(word(5, "2").c_str());
    const auto backend = create_backend("cpu").backend;
    std::printf("%d view(s); X-rays simulated from the CT (trilinear projector, 0.4 voxel steps)\n", views);
    for (const std::string& name : split(word(2, "noise"))) {
        const Scene scene = make_scene(name, ct, views, std::atoi(word(7, "256").c_str()));
        for (const std::string& variant : split(word(6, "auto"))) {
            for (const std::string& interval : split(word(3, "0:20,20:40,40:60"))) {
                double low_mm = 0, high_mm = 0;
                if (std::sscanf(interval.c_str(), "%lf:%lf", &low_mm, &high_mm) != 2)
                    throw Error("interval " + interval);
                print_interval(scene, variant, low_mm, high_mm, trials, *backend, record);
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
                     "usage: raylign_robustness CT [scenes] [intervals_mm] [trials] [views] [variants] [pixels]\n");
        return 2;
    }
    try {
        raylign::detail::bench::Record record(
            argc, argv, "Far starts, mismatch, verdict",
            {"scene", "variant", "views", "from [mm]", "to [mm]", "success", "of", "error, p50 [mm]", "error, max [mm]",
             "time, median [s]", "linearizations", "failures doubted", "successes doubted"});
        return raylign::detail::bench::run(argc, argv, record);
    } catch (const raylign::Error& error) {
        std::fprintf(stderr, "raylign_robustness: %s\n", error.what());
        return 2;
    }
}

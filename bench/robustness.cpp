// How far registration reaches, and whether it knows when it failed: success by initial error in scenes that the CT
// explains less and less. X-rays are simulated by the other projector (trilinear, 0.4 voxel steps) from a volume that
// differs from the CT as the scene says. Usage:
//   raylign_robustness CT [scenes=noise] [intervals_mm=0:20,20:40,40:60] [trials=50] [views=2] [variants=auto]
//                      [pixels=256] [xray=MODEL] [angle=DEG] [field=MM] [other=CT] [poses=N] [--json FILE]
// Several scenes, intervals or variants stand between commas. RAYLIGN_LIST=1 prints every trial. Options with a name
// stand anywhere: `xray` makes every scene by an X-ray model (c-arm, biplane-lab, flat-panel; default ideal), `angle`
// is that between the two views (default 90), `field` what they show at the isocentre (default 400); trials take
// `poses` poses of the object in turn, each with X-rays of its own (default 1).
// Scenes, of any CT but the vertebrae:
//   clean, noise, scatter, metal (clean has no noise and scatter adds some with the ideal detector only)
//   truncated                  the CT ends where the X-ray goes on: the middle 60 % along z are registered
//   wrong-view-N               the second camera is believed N degrees off, wrong-view-Nmm: N mm
//   wrong-sdd-N                both views are believed to have an sdd N % longer
//   other                      X-rays of other=CT: no pose is right, and all results should be doubted
//   vertebra-1 to vertebra-5   lower to upper thoracic; the boxes are for the chest CT of the tests
//   spine                      the third vertebra of the spine phantom, cut exactly, in the X-ray of all of it
// Variants:
//   auto, no-robust, one-level, no-search, steepest-descent, bobyqa
//   part                       as part, without a search
//   global                     without a start: turned by up to 40 degrees and anywhere in view
// The columns of the verdict count the failures that it doubted, and the successes that it doubted. The last ones hold
// the true error against the expected one (1 sigma): the share of results that are not doubted within twice of it.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/program.h"
#include "bench/record.h"
#include "bench/robustness_scene.h"
#include "core/base/error.h"
#include "core/base/random.h"
#include "core/base/text.h"
#include "raylign/backends.h"
#include "raylign/io/volume.h"
#include "raylign/registration.h"
#include "raylign/targets.h"
#include "raylign/xray.h"

namespace raylign::detail::bench {
namespace {

struct Trial {
    double initial_mm = 0, final_mm = 0;
    std::vector<double> rivals_mm;  ///< how far the rivals are off
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
    for (const Rival& rival : trial.found.search.rivals)
        trial.rivals_mm.push_back(target_errors(rival.world_from_ct, scene.truth, scene.targets, geometry).mtre_mm);
    const bool single = scene.views.size() == 1;
    trial.final_mm = single ? errors.mean_mrpd_mm : errors.mtre_mm;
    trial.success = trial.final_mm < (single ? 1 : scene.success_mm);
    return trial;
}

void list_verdict(const RegistrationResult& found) {
    std::printf(found.ok ? " ok\n" : " doubtful:");
    for (const std::string& reason : found.reasons)
        std::printf(" %s%s", reason.c_str(), &reason == &found.reasons.back() ? "\n" : ";");
}

void list_search(const Trial& trial) {
    const SearchReport& search = trial.found.search;
    std::printf(" agree %d of %d search %.4f", search.agreeing, search.refined, search.cost);
    for (std::size_t r = 0; r < search.rivals.size(); ++r)
        std::printf(" [rival %.2f mm: +%.4f]", trial.rivals_mm[r], search.rivals[r].cost - search.cost);
}

void list_trial(int number, const Trial& trial) {
    const RegistrationResult& found = trial.found;
    ViewCorrection worst;
    for (const ViewResult& view : found.views) {
        if (view.correction.significance > worst.significance) worst = view.correction;
    }
    std::printf("  %3d %s start %6.2f end %8.3f expected %.3f cost %.4f from %.4f views", number,
                trial.success ? "+" : "-", trial.initial_mm, trial.final_mm, found.confidence.rim_mm, found.cost_final,
                found.cost_initial);
    for (const double cost : found.view_costs) std::printf(" %.3f", cost);
    std::printf(" lin %4llu eval %5llu %5.2f s corrections %.2f %.2f mm",
                static_cast<unsigned long long>(found.counters.linearizations),
                static_cast<unsigned long long>(found.counters.evaluations), found.total_s, worst.significance,
                worst.effect_mm);
    list_search(trial);
    list_verdict(found);
}

/// Trials take the scenes, one kind at several poses, in turn.
void print_interval(const std::vector<Scene>& scenes, const std::string& variant, double low_mm, double high_mm,
                    int trials, Backend& backend, Record& record) {
    int successes = 0, caught = 0, doubted = 0, believed = 0, within = 0;
    std::vector<double> final_mm, of_expected, seconds, linearizations;
    for (int number = 0; number < trials; ++number) {
        const std::uint64_t seed = 1000 * static_cast<std::uint64_t>(high_mm) + number;
        const Scene& scene = scenes[number % scenes.size()];
        const Trial trial = run_trial(scene, variant, Random(seed).uniform(low_mm, high_mm), seed, backend);
        successes += trial.success;
        caught += !trial.success && !trial.found.ok;
        doubted += trial.success && !trial.found.ok;
        believed += trial.found.ok;
        within += trial.found.ok && trial.final_mm < 2 * trial.found.confidence.rim_mm;
        of_expected.push_back(trial.final_mm / trial.found.confidence.rim_mm);
        final_mm.push_back(trial.final_mm);
        seconds.push_back(trial.found.total_s);
        linearizations.push_back(static_cast<double>(trial.found.counters.linearizations));
        if (std::getenv("RAYLIGN_LIST")) list_trial(number, trial);
    }
    std::printf(
        "%-11s %-16s %3.0f-%-3.0f %4d/%-4d p50 %6.3f p95 %6.3f max %6.2f mm  %5.2f s (p95 %5.2f) %4.0f lin  "
        "caught %d/%d doubted %d/%d true/expected p50 %.2f p95 %.2f within 2 sigma %d/%d believed\n",
        scenes.front().name.c_str(), variant.c_str(), low_mm, high_mm, successes, trials, percentile(final_mm, 0.5),
        percentile(final_mm, 0.95), percentile(final_mm, 1), percentile(seconds, 0.5), percentile(seconds, 0.95),
        percentile(linearizations, 0.5), caught, trials - successes, doubted, successes, percentile(of_expected, 0.5),
        percentile(of_expected, 0.95), within, believed);
    std::fflush(stdout);
    record.add({scenes.front().name, variant, scenes.front().views.size(), low_mm, high_mm, successes, trials,
                percentile(final_mm, 0.5), percentile(final_mm, 1), percentile(seconds, 0.5),
                percentile(linearizations, 0.5), caught, doubted, percentile(of_expected, 0.5), within, believed});
}

std::vector<std::string> split(const std::string& text) {
    std::vector<std::string> parts;
    std::stringstream list(text);
    for (std::string part; std::getline(list, part, ',');) parts.push_back(part);
    return parts;
}

double number_of(const std::string& name, const std::string& text, double low, double high) {
    std::size_t used = 0;
    double value = std::nan("");
    try {
        value = std::stod(text, &used);
    } catch (const std::logic_error&) {  // no number at all
    }
    if (used != text.size() || !(value >= low && value <= high)) {
        throw bad_value(name, text, text_of("in [", low, ", ", high, "]"));
    }
    return value;
}

/// Takes NAME=VALUE out of the words; `pose` is the last one's number.
SceneSettings settings_of(std::vector<std::string>& words) {
    SceneSettings settings;
    std::vector<std::string> rest;
    for (const std::string& word : words) {
        const auto option = name_and_value(word);
        if (!option) {
            rest.push_back(word);
        } else if (option->first == "xray") {
            settings.xray = xray_model(option->second).name;
        } else if (option->first == "angle") {
            settings.angle_deg = number_of("angle", option->second, 1, 179);
        } else if (option->first == "field") {
            settings.field_mm = number_of("field", option->second, 10, 2000);
        } else if (option->first == "other") {
            settings.other = read_volume(option->second).volume;
        } else if (option->first == "poses") {
            settings.pose = static_cast<int>(number_of("poses", option->second, 1, 1000)) - 1;
        } else {
            throw bad_value("option", option->first, "xray, angle, field, other or poses");
        }
    }
    words = rest;
    return settings;
}

std::vector<Scene> make_scenes(const std::string& name, const Volume& ct, SceneSettings settings) {
    std::vector<Scene> scenes;
    const int poses = settings.pose + 1;
    for (settings.pose = 0; settings.pose < poses; ++settings.pose) scenes.push_back(make_scene(name, ct, settings));
    return scenes;
}

int run(std::vector<std::string> words, Record& record) {
    SceneSettings settings = settings_of(words);
    if (words.empty()) throw Error("no CT is given");
    const auto word = [&](std::size_t i, const char* fallback) { return words.size() > i ? words[i] : fallback; };
    const Volume ct = read_volume(words[0]).volume;
    const int trials = static_cast<int>(number_of("trials", word(3, "50"), 1, 1e6));
    settings.views = static_cast<int>(number_of("views", word(4, "2"), 1, 2));
    settings.pixels = static_cast<int>(number_of("pixels", word(6, "256"), 32, 4096));
    const auto backend = create_backend("cpu").backend;
    std::printf("%d view(s)%s; X-rays simulated from the CT (trilinear projector, 0.4 voxel steps), model %s\n",
                settings.views, settings.views < 2 ? "" : text_of(", ", settings.angle_deg, " degrees apart").c_str(),
                settings.xray.c_str());
    for (const std::string& name : split(word(1, "noise"))) {
        const std::vector<Scene> scenes = make_scenes(name, ct, settings);
        for (const std::string& variant : split(word(5, "auto"))) {
            for (const std::string& interval : split(word(2, "0:20,20:40,40:60"))) {
                double low_mm = 0, high_mm = 0;
                if (std::sscanf(interval.c_str(), "%lf:%lf", &low_mm, &high_mm) != 2)
                    throw Error("interval " + interval);
                print_interval(scenes, variant, low_mm, high_mm, trials, *backend, record);
            }
        }
    }
    record.note(text_of("X-rays simulated from the CT, model ", settings.xray, ", poses: ", settings.pose + 1));
    record.write();
    return 0;
}

}  // namespace
}  // namespace raylign::detail::bench

int main(int argc, char** argv) {
    if (argc < 2) {
        std::fprintf(stderr,
                     "usage: raylign_robustness CT [scenes] [intervals_mm] [trials] [views] [variants] [pixels] "
                     "[xray=MODEL] [angle=DEG] [field=MM] [other=CT] [poses=N]\n");
        return 2;
    }
    return raylign::detail::bench::run_program("raylign_robustness", [&] {
        raylign::detail::bench::Record record(
            argc, argv, "Far starts, mismatch, verdict",
            {"scene", "variant", "views", "from [mm]", "to [mm]", "success", "of", "error, p50 [mm]", "error, max [mm]",
             "time, median [s]", "linearizations", "failures doubted", "successes doubted",
             "true error over expected, p50", "within twice the expected", "not doubted"});
        return raylign::detail::bench::run({argv + 1, argv + argc}, record);
    });
}

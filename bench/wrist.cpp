// Real X-rays: the radius of a wrist in two biplane views, against a reference pose, from random starts. Usage:
//   raylign_wrist FOLDER [mode=near|global|together] [starts=50] [initial mTRE, mm=15] [backend=cpu] [instants=2,99]
//                 [--json FILE]
//   near     starts are uniform up to the initial mTRE
//   global   without a start: an orientation that is up to 45 degrees off (uniform in the ball of rotation vectors),
//            the bone where the central rays meet; the seed is the trial's
//   together near, the radius and metacarpals, together and each alone (wrist_together.h)
// Success: the bone's centre within 0.5 mm and the rotation within 2 degrees of the reference. RAYLIGN_LIST=1 prints
// every trial.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <sstream>

#include "bench/program.h"
#include "bench/record.h"
#include "bench/wrist_together.h"
#include "core/base/error.h"
#include "core/base/median.h"
#include "core/base/random.h"
#include "raylign/backends.h"
#include "raylign/registration.h"
#include "raylign/start.h"
#include "raylign/targets.h"
#include "tests/support/wrist.h"

namespace raylign::detail::bench {
namespace {

constexpr double kRoughTurn_rad = std::numbers::pi / 4;

struct Outcome {
    double centre_mm = 0, rotation_deg = 0;
    RegistrationResult found;
    [[nodiscard]] bool success() const { return centre_mm < kCentreBound_mm && rotation_deg < kRotationBound_deg; }
};

RigidTransform start_of(const test::Wrist& wrist, bool global, double most_mm, std::uint64_t seed) {
    const RigidTransform& reference = wrist.reference_world_from_ct;
    Random random(seed);
    if (!global) {
        const auto targets = default_targets_ct_mm(wrist.radius);
        return perturbed_start(reference, targets, random.uniform(0, most_mm), seed);
    }
    Twist turn = Twist::Zero();
    turn.head<3>() = kRoughTurn_rad * std::cbrt(random.uniform()) * random.direction();
    const RigidTransform turned{(exp_about(turn, Eigen::Vector3d::Zero()) * reference).rotation,
                                Eigen::Vector3d::Zero()};
    const Eigen::Vector3d centre_ct = wrist.radius.grid.centre_ct_mm();
    const Eigen::Vector3d middle_world = default_start(wrist.radius.grid, wrist.views) * centre_ct;
    return RigidTransform::translate(middle_world - turned * centre_ct) * turned;
}

Outcome run_trial(const test::Wrist& wrist, bool global, double most_mm, std::uint64_t seed, Backend& backend) {
    RegistrationOptions options;
    options.search.seed = seed;
    if (global) {
        options.search.mode = Search::global;
        options.content = Content::part;
    }
    const RigidTransform start = start_of(wrist, global, most_mm, seed);
    Outcome outcome{.found = register_volume(wrist.radius, wrist.views, start, options, backend)};
    const Eigen::Vector3d centre_ct = wrist.radius.grid.centre_ct_mm();
    const RigidTransform& pose = outcome.found.world_from_ct;
    outcome.centre_mm = (pose * centre_ct - wrist.reference_world_from_ct * centre_ct).norm();
    outcome.rotation_deg = rotation_angle_rad(pose * inverse(wrist.reference_world_from_ct)) * 180 / std::numbers::pi;
    return outcome;
}

void list_trial(int number, const Outcome& outcome) {
    const RegistrationResult& found = outcome.found;
    const double gap = found.search.rivals.empty() ? 0 : found.search.rivals.front().cost - found.search.cost;
    std::printf(
        "  %3d %s %7.3f mm %6.2f deg expected %.3f mm cost %.4f agree %d gap %.4f lin %llu eval %llu %.2f s %s%s\n",
        number, outcome.success() ? "+" : "-", outcome.centre_mm, outcome.rotation_deg, found.confidence.rim_mm,
        found.cost_final, found.search.agreeing, gap, static_cast<unsigned long long>(found.counters.linearizations),
        static_cast<unsigned long long>(found.counters.evaluations), found.total_s,
        found.ok ? "ok" : "doubtful: ", found.ok ? "" : found.reasons.front().c_str());
    std::fflush(stdout);
}

void run_instant(const std::filesystem::path& folder, int instant, bool global, int starts, double most_mm,
                 Backend& backend, Record& record) {
    const test::Wrist wrist = test::read_wrist(folder, instant);
    int successes = 0, caught = 0, doubted = 0;
    std::vector<double> centre_mm, rotation_deg, seconds;
    for (int number = 0; number < starts; ++number) {
        const Outcome outcome = run_trial(wrist, global, most_mm, static_cast<std::uint64_t>(number), backend);
        successes += outcome.success();
        caught += !outcome.success() && !outcome.found.ok;
        doubted += outcome.success() && !outcome.found.ok;
        centre_mm.push_back(outcome.centre_mm);
        rotation_deg.push_back(outcome.rotation_deg);
        seconds.push_back(outcome.found.total_s);
        if (std::getenv("RAYLIGN_LIST")) list_trial(number, outcome);
    }
    std::printf(
        "instant %2d %s %d of %d, median %.3f mm %.2f deg, %.2f s; failures doubted %d of %d, successes %d of %d\n",
        instant, global ? "global" : "near", successes, starts, median(centre_mm), median(rotation_deg),
        median(seconds), caught, starts - successes, doubted, successes);
    std::fflush(stdout);
    record.add({global ? "global" : "near", instant, successes, starts, median(centre_mm), median(rotation_deg), caught,
                doubted, median(seconds)});
}

int run(int argc, char** argv, Record& record) {
    const auto word = [&](int i, const char* fallback) { return std::string(argc > i ? argv[i] : fallback); };
    const std::string mode = word(2, "near");
    if (mode != "near" && mode != "global" && mode != "together") {
        throw Error("mode " + mode + " (allowed: near, global, together)");
    }
    const auto backend = create_backend(word(5, "cpu")).backend;
    std::stringstream instants(word(6, "2,99"));
    const int starts = std::max(1, std::stoi(word(3, "50")));
    const double most_mm = std::stod(word(4, "15"));
    for (std::string instant; std::getline(instants, instant, ',');) {
        if (mode == "together") {
            run_together(argv[1], std::stoi(instant), starts, most_mm, *backend, record);
        } else {
            run_instant(argv[1], std::stoi(instant), mode == "global", starts, most_mm, *backend, record);
        }
    }
    record.write();
    return 0;
}

}  // namespace
}  // namespace raylign::detail::bench

int main(int argc, char** argv) {
    if (argc < 2) {
        std::fprintf(stderr,
                     "usage: raylign_wrist FOLDER [near|global|together] [starts] [mTRE_mm] [backend] [instants]\n");
        return 2;
    }
    return raylign::detail::bench::run_program("raylign_wrist", [&] {
        using Columns = std::vector<std::string>;
        const bool is_together = argc > 2 && std::string(argv[2]) == "together";
        const Columns one{"search",
                          "instant",
                          "success",
                          "of",
                          "centre, median [mm]",
                          "rotation, median [deg]",
                          "failures doubted",
                          "successes doubted",
                          "time, median [s]"};
        const Columns two{"how",
                          "instant",
                          "beside the radius",
                          "radius right",
                          "of",
                          "radius: centre, median [mm]",
                          "radius: rotation, median [deg]",
                          "radius called ok",
                          "other within 0.5 mm and 2 degrees",
                          "other: centre, median [mm]",
                          "other: rotation, median [deg]",
                          "other: centre, max [mm]",
                          "other called ok",
                          "processor time, median [s]"};
        raylign::detail::bench::Record record(
            argc, argv,
            is_together ? "Real X-rays: radius and metacarpals of a wrist" : "Real X-rays: the radius of a wrist",
            is_together ? two : one);
        return raylign::detail::bench::run(argc, argv, record);
    });
}

// The main job in numbers: a real CT, simulated X-rays with photon noise, random starts of one initial error, several
// backends. Usage:
//   raylign_starts CT [initial_mtre_mm=8] [seeds=10] [pixels=256] [backends=cpu] [method=auto] [field_mm=400]
//                  [photons=20000] [--json FILE]
// backends: names with commas. `reference` is slow: give it 48 or 64 pixels. The X-rays are simulated from the CT
// itself, by the other projector (trilinear, 0.4 voxel steps) on the full grid; the heading of each case says so.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <sstream>
#include <string>
#include <vector>

#include "bench/program.h"
#include "bench/record.h"
#include "core/base/error.h"
#include "raylign/backends.h"
#include "raylign/io/volume.h"
#include "raylign/registration.h"
#include "raylign/simulate.h"
#include "raylign/targets.h"
#include "tests/support/scenes.h"

namespace raylign::detail::bench {
namespace {

std::vector<View> simulate(const Volume& volume, std::vector<View> views, const RigidTransform& truth, double photons) {
    const RenderSettings fine{Projector::trilinear, 0.4 * volume.grid.spacing_mm.minCoeff()};
    const auto session = create_backend("cpu").backend->prepare({volume, views, fine, {}});
    for (std::size_t v = 0; v < views.size(); ++v) {
        views[v].image = with_photon_noise(session->render(truth, v), photons, 100 + v);
    }
    return views;
}

/// The world's isocentre lies in the middle of the CT, turned and shifted a little: no symmetry to profit from.
RigidTransform hidden_pose(const Volume& volume) {
    return test::oblique_pose() * RigidTransform::translate(-volume.grid.centre_ct_mm());
}

struct Run {
    double initial_mm = 0, final_mm = 0, mrpd_mm = 0, cost = 0, seconds = 0, processor_s = 0;
    std::uint64_t evaluations = 0, linearizations = 0;
    bool ok = false;
    RigidTransform pose;
};

struct Job {
    Volume volume;
    std::vector<View> views;
    std::vector<Eigen::Vector3d> targets;
    RigidTransform truth;
    Method method;
};

Run run_one(const Job& job, Backend& backend, double mtre_mm, std::uint64_t seed) {
    const RigidTransform start = perturbed_start(job.truth, job.targets, mtre_mm, seed);
    const std::clock_t before = std::clock();
    const RegistrationResult result = register_volume(job.volume, job.views, start, {.method = job.method}, backend);
    const double processor_s = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
    std::vector<ViewGeometry> geometry;
    for (const View& view : job.views) geometry.push_back(view.geometry);
    const TargetErrors errors = target_errors(result.world_from_ct, job.truth, job.targets, geometry);
    return {mtre_mm,        errors.mtre_mm,      errors.mean_mrpd_mm,         result.cost_final,
            result.total_s, processor_s,         result.counters.evaluations, result.counters.linearizations,
            result.ok,      result.world_from_ct};
}

void print_case(const char* name, const Job& job, const std::vector<std::string>& backends, double mtre_mm, int seeds,
                Record& record) {
    const double half_voxel_mm = job.volume.grid.spacing_mm.minCoeff() / 2;
    std::printf("\n%s, start %.0f mm away, %d seeds, X-rays simulated from the CT (trilinear, noise)\n", name, mtre_mm,
                seeds);
    std::printf("%-10s %4s %9s %9s %10s %6s %6s %7s %7s %s\n", "backend", "seed", "mTRE mm", "mRPD mm", "cost", "evals",
                "lins", "s", "cpu s", "ok");
    std::vector<std::vector<Run>> all;
    for (const std::string& name_of_backend : backends) {
        const auto backend = create_backend(name_of_backend).backend;
        all.emplace_back();
        int successes = 0;
        double largest_mm = 0;
        std::vector<double> seconds, processor_s;
        for (int seed = 1; seed <= seeds; ++seed) {
            const Run r = run_one(job, *backend, mtre_mm, seed);
            std::printf("%-10s %4d %9.4f %9.4f %10.6f %6llu %6llu %7.2f %7.3f %s\n", name_of_backend.c_str(), seed,
                        r.final_mm, r.mrpd_mm, r.cost, static_cast<unsigned long long>(r.evaluations),
                        static_cast<unsigned long long>(r.linearizations), r.seconds, r.processor_s,
                        r.ok ? "yes" : "no");
            successes += r.final_mm < half_voxel_mm;
            largest_mm = std::max(largest_mm, r.final_mm);
            seconds.push_back(r.seconds);
            processor_s.push_back(r.processor_s);
            all.back().push_back(r);
        }
        std::ranges::sort(seconds);
        std::ranges::sort(processor_s);
        std::printf("%s: %d of %d below half a voxel (%.3f mm), median %.2f s, %.3f s of processor time\n",
                    name_of_backend.c_str(), successes, seeds, half_voxel_mm, seconds[seconds.size() / 2],
                    processor_s[processor_s.size() / 2]);
        record.add({name, name_of_backend, mtre_mm, successes, seeds, seconds[seconds.size() / 2], largest_mm});
    }
    for (std::size_t b = 1; b < all.size(); ++b) {
        double apart_mm = 0, cost = 0;
        for (int i = 0; i < seeds; ++i) {
            apart_mm = std::max(apart_mm, mean_target_error_mm(all[b][i].pose, all[0][i].pose, job.targets));
            cost = std::max(cost, std::abs(all[b][i].cost - all[0][i].cost));
        }
        std::printf("%s and %s: final poses at most %.5f mm mTRE apart, costs %.1e\n", backends[b].c_str(),
                    backends[0].c_str(), apart_mm, cost);
    }
}

int run(int argc, char** argv, Record& record) {
    const auto number = [&](int i, double fallback) { return argc > i ? std::atof(argv[i]) : fallback; };
    std::vector<std::string> backends;
    std::stringstream list(argc > 5 ? argv[5] : "cpu");
    for (std::string name; std::getline(list, name, ',');) backends.push_back(name);

    Job job{.volume = read_volume(argv[1]).volume};
    job.truth = hidden_pose(job.volume);
    job.targets = default_targets_ct_mm(job.volume);
    job.method = method_from_name(argc > 6 ? argv[6] : "auto");
    job.views = simulate(job.volume, test::biplane_views(static_cast<int>(number(4, 256)), number(7, 400)), job.truth,
                         number(8, 20000));
    print_case("biplane", job, backends, number(2, 8), static_cast<int>(number(3, 10)), record);
    job.views.resize(1);
    print_case("single view", job, backends, number(2, 8), static_cast<int>(number(3, 10)), record);
    record.note("X-rays simulated from the CT (trilinear, noise)");
    record.write();
    return 0;
}

}  // namespace
}  // namespace raylign::detail::bench

int main(int argc, char** argv) {
    if (argc < 2) {
        std::fprintf(
            stderr,
            "usage: raylign_starts CT [initial_mtre_mm] [seeds] [pixels] [backends] [method] [field_mm] [photons]\n");
        return 2;
    }
    return raylign::detail::bench::run_program("raylign_starts", [&] {
        raylign::detail::bench::Record record(
            argc, argv, "Accuracy on a CT",
            {"views", "backend", "start mTRE [mm]", "success", "of", "time, median [s]", "largest final mTRE [mm]"});
        return raylign::detail::bench::run(argc, argv, record);
    });
}

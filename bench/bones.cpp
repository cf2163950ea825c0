// Bones, each moved by its own rigid motion against the others, registered together (and, with --alone, each alone as a
// part): vertebrae of the spine phantom, the two halves of a pelvis, two vertebrae of a chest CT, or labels of a CT.
// X-rays are ideal with quantum noise, or by an X-ray model (bones_scene.h). Success is told per object.
//   raylign_bones [--trials N] [--first N] [--rest none|still|body] [--views 1|2] [--objects N] [--photons N] [--off
//   MM]
//                 [--moved N] [--alone] [--xray MODEL] [--body MM,MM] [--joint MM,DEG] [--success MM] [--halvings N]
//                 [--hemipelves FILE | --chest FILE [--labels FILE --names A,B]] [--json FILE]

#include "bench/bones_scene.h"

#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>

#include "bench/program.h"
#include "bench/record.h"
#include "core/base/random.h"
#include "raylign/backends.h"
#include "raylign/targets.h"

namespace raylign::detail::bench {
namespace {

/// What a row of the table says.
struct Tally {
    double success_mm = 0.5;
    int objects = 0, within = 0, ok = 0, wrong_but_ok = 0, covered = 0;
    std::vector<double> errors_mm, depth_errors_mm, expected_mm, seconds;

    void count(double error_mm, double depth_mm, const RegistrationResult& found) {
        ++objects;
        within += error_mm < success_mm ? 1 : 0;
        errors_mm.push_back(error_mm);
        depth_errors_mm.push_back(std::abs(depth_mm));
        if (!found.ok) return;
        ++ok;
        wrong_but_ok += error_mm > 2 * success_mm ? 1 : 0;
        covered += error_mm < 2 * found.confidence.rim_mm ? 1 : 0;
        expected_mm.push_back(found.confidence.rim_mm);
    }
};

double quantile(std::vector<double> values, double share) {
    if (values.empty()) return std::nan("");
    std::ranges::sort(values);
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

std::vector<SceneObject> scene_of(const Body& body, const BonesSettings& settings, const BonesTrial& trial) {
    std::vector<SceneObject> objects;
    for (std::size_t k = 0; k < body.bones.size(); ++k) {
        objects.push_back({body.bones[k].name, body.bones[k].volume, trial.starts[k]});
    }
    if (settings.rest != "none") {
        const Mobility mobility = settings.rest == "still" ? Mobility::stays : Mobility::moves;
        objects.push_back({"rest", body.rest, body.pose, mobility, true});
    }
    return objects;
}

/// How far the pose has the bone's middle behind the true place, as the first view sees it.
double depth_error_mm(const RigidTransform& found, const RigidTransform& truth, const Bone& bone, const View& view) {
    const Eigen::Vector3d centre = targets_centre_mm(bone.targets);
    return (view.geometry.camera_from_world * (found * centre) - view.geometry.camera_from_world * (truth * centre))
        .z();
}

/// A search that finds no place at all leaves the start, which is then doubtful.
RegistrationResult registered_alone(const Volume& volume, const std::vector<View>& views, const RigidTransform& start,
                                    Backend& backend) {
    try {
        return register_volume(volume, views, start, {.content = Content::part}, backend);
    } catch (const Error& error) {
        RegistrationResult none;
        none.world_from_ct = start;
        none.ok = false;
        none.reasons.emplace_back(error.what());
        return none;
    }
}

void count_alone(const Body& body, const BonesTrial& trial, const std::vector<View>& views, std::size_t k,
                 Backend& backend, Tally& alone) {
    const RegistrationResult one = registered_alone(body.bones[k].volume, views, trial.starts[k], backend);
    const double error = mean_target_error_mm(one.world_from_ct, trial.truth[k], body.bones[k].targets);
    alone.count(error, depth_error_mm(one.world_from_ct, trial.truth[k], body.bones[k], views.front()), one);
    std::cout << " | alone " << error << " expected " << one.confidence.rim_mm << (one.ok ? " ok" : " doubtful");
}

void run_trial(const Body& body, const BonesSettings& settings, int seed, Backend& backend, Tally& together,
               Tally& alone) {
    const BonesTrial trial = make_trial(body, settings, seed);
    const std::vector<View> views = take_xrays(body, trial.truth, settings, seed, backend);
    const std::vector<SceneObject> objects = scene_of(body, settings, trial);
    const double before_s = processor_s();
    const SceneResult scene = register_scene(objects, views, {}, backend, {}, body.joints);
    const double used_s = processor_s() - before_s;
    together.seconds.push_back(scene.total_s);
    std::cout << "trial " << seed << ": moving together " << scene.together_s << " s, all " << scene.total_s
              << " s, processor " << used_s << " s, cost " << scene.cost_final << ", iterations " << scene.iterations
              << "\n";
    for (const std::string& decision : scene.decisions) std::cout << "  " << decision << "\n";
    double alone_s = processor_s();
    for (std::size_t k = 0; k < body.bones.size(); ++k) {
        const auto error_mm = [&](const RigidTransform& pose) {
            return mean_target_error_mm(pose, trial.truth[k], body.bones[k].targets);
        };
        const RegistrationResult& found = scene.objects[k];
        const double depth_mm = depth_error_mm(found.world_from_ct, trial.truth[k], body.bones[k], views.front());
        together.count(error_mm(found.world_from_ct), depth_mm, found);
        std::cout << "  " << objects[k].name << " start " << error_mm(trial.starts[k]) << " together "
                  << error_mm(scene.together[k]) << " found " << error_mm(found.world_from_ct) << " depth " << depth_mm
                  << " expected " << found.confidence.rim_mm << " (depth " << found.confidence.in_depth_mm << ")"
                  << " cost " << found.cost_final << (found.ok ? " ok" : " doubtful: " + found.reasons.front());
        if (settings.alone) count_alone(body, trial, views, k, backend, alone);
        std::cout << std::endl;
    }
    if (settings.alone) {
        alone_s = processor_s() - alone_s;
        alone.seconds.push_back(alone_s);
        std::cout << "  alone: processor " << alone_s << " s\n";
    }
}

void report(const char* name, const BonesSettings& settings, const Tally& tally, Record& record) {
    std::cout << name << ": below " << tally.success_mm << " mm " << tally.within << " of " << tally.objects
              << ", called ok " << tally.ok << ", of these off by more than twice that " << tally.wrong_but_ok
              << ", within twice the expected error " << tally.covered << ", p50 " << quantile(tally.errors_mm, 0.5)
              << " max " << quantile(tally.errors_mm, 1) << " mm, depth p50 " << quantile(tally.depth_errors_mm, 0.5)
              << ", expected p50 " << quantile(tally.expected_mm, 0.5) << ", median " << quantile(tally.seconds, 0.5)
              << " s\n";
    record.add({name, settings.views, tally.within, tally.objects, quantile(tally.errors_mm, 0.5),
                quantile(tally.errors_mm, 1), quantile(tally.depth_errors_mm, 0.5), quantile(tally.expected_mm, 0.5),
                tally.covered, tally.ok, tally.wrong_but_ok, quantile(tally.seconds, 0.5)});
}

void add_options(CLI::App& app, BonesSettings& settings) {
    app.add_option("--trials", settings.trials);
    app.add_option("--first", settings.first);
    app.add_option("--rest", settings.rest);
    app.add_option("--views", settings.views);
    app.add_option("--objects", settings.objects);
    app.add_option("--photons", settings.photons);
    app.add_option("--moved", settings.moved);
    app.add_option("--off", settings.off_mm);
    app.add_option("--success", settings.success_mm);
    app.add_option("--halvings", settings.halvings);
    app.add_option("--hemipelves", settings.hemipelves);
    app.add_option("--chest", settings.chest);
    app.add_option("--labels", settings.labels);
    app.add_option("--names", settings.names)->delimiter(',');
    app.add_option("--xray", settings.xray);
    app.add_option("--joint", settings.joint)->delimiter(',')->expected(2);
    app.add_option("--body", settings.body_mm)->delimiter(',')->expected(2);
    app.add_flag("--alone", settings.alone);
}

int run(int argc, char** argv) {
    Record record(
        argc, argv, "Several bones at once",
        {"how", "views", "success", "of", "error, p50 [mm]", "error, max [mm]", "in depth, p50 [mm]",
         "expected error, p50 [mm]", "within twice the expected", "called ok", "of these wrong", "time, median [s]"});
    BonesSettings settings;
    CLI::App app("Several bones at once");
    add_options(app, settings);
    CLI11_PARSE(app, argc, argv);
    const Body body = make_body(settings);
    const auto backend = create_backend("cpu").backend;
    Tally together{settings.success_mm}, alone{settings.success_mm};
    for (int i = 0; i < settings.trials; ++i) {
        run_trial(body, settings, settings.first + i, *backend, together, alone);
    }
    report(settings.joint.empty() ? "together" : "together, joints", settings, together, record);
    if (settings.alone) report("alone", settings, alone, record);
    rusage used{};
    getrusage(RUSAGE_SELF, &used);
    record.note("X-rays by model " + settings.xray + "; peak memory " + std::to_string(used.ru_maxrss / 1024) + " MiB");
    std::cout << "peak memory " << used.ru_maxrss / 1024 << " MiB\n";
    record.write();
    return 0;
}

}  // namespace
}  // namespace raylign::detail::bench

int main(int argc, char** argv) {
    using namespace raylign::detail::bench;
    return run_program("raylign_bones", [&] { return run(argc, argv); });
}

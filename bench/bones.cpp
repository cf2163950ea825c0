// Bones, each moved by its own rigid motion against the others, registered together (and, with --alone, each alone as a
// part): vertebrae of the spine phantom, or the two halves of a pelvis. X-rays of the phantom are exact line integrals
// of its solids, no grid has a part in them; those of the pelvis go by trilinear steps through a grid twice as fine as
// the one registered. Quantum noise. Success is told per object.
//   raylign_bones [--trials N] [--first N] [--rest none|still|body] [--views 1|2] [--objects N] [--photons N] [--off
//   MM]
//                 [--moved N] [--alone] [--hemipelves FILE]

#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>
#include <numbers>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "core/image/pyramid.h"
#include "core/image/region.h"
#include "core/registration/scene/scene.h"
#include "raylign/backends.h"
#include "raylign/io/volume.h"
#include "raylign/targets.h"
#include "tests/support/scenes.h"

namespace raylign::detail::bench {
namespace {

struct Settings {
    int trials = 5, first = 0, views = 2, objects = 5;
    std::string rest = "none", hemipelves;
    double photons = 1e5, moved = 5, off_mm = 5;  ///< moved: mm and degrees, per component
    bool alone = false;
};

const Eigen::Vector3d kExtent_mm = Eigen::Vector3d::Constant(200);

struct Bone {
    Phantom solid;        ///< of the spine
    Volume fine, volume;  ///< of a pelvis: what X-rays are made of; what is registered
    std::vector<Eigen::Vector3d> targets;
};

struct Spine {
    Phantom whole;
    std::vector<Bone> bones;
    Volume rest;
};

Spine make_spine(int objects) {
    Spine spine{spine_phantom(kExtent_mm), {}, {}};
    spine.rest = voxelise(spine.whole, centred_grid({100, 100, 100}, {2, 2, 2}), 3);
    for (int level = 0; level < objects; ++level) {
        Bone bone{spine_vertebra(kExtent_mm, level), {}, {}, {}};
        const Volume fine = voxelise(bone.solid, centred_grid({200, 200, 200}, {1, 1, 1}), 3);
        bone.volume = crop(fine, box_of_object(fine));
        bone.targets = default_targets_ct_mm(bone.volume);
        const Volume coarse = voxelise(bone.solid, spine.rest.grid, 3);
        for (std::size_t i = 0; i < coarse.attenuation_per_mm.size(); ++i) {
            spine.rest.attenuation_per_mm[i] -= coarse.attenuation_per_mm[i];
        }
        spine.bones.push_back(std::move(bone));
    }
    return spine;
}

/// The halves of a pelvis, cut at the middle column; no soft tissue.
Spine make_hemipelves(const std::string& file) {
    const Volume whole = read_volume(file, {.object = {.bone_threshold_hu = 150}}).volume;
    Spine pelvis;
    for (int half = 0; half < 2; ++half) {
        Volume side = whole;
        const int columns = side.grid.size.x();
        for (std::size_t i = 0; i < side.attenuation_per_mm.size(); ++i) {
            const bool is_right = static_cast<int>(i % columns) < columns / 2;
            if (is_right != (half == 0)) side.attenuation_per_mm[i] = 0;
        }
        Bone bone{{}, crop(side, box_of_object(side)), {}, {}};
        bone.volume = half_resolution(bone.fine);
        bone.targets = default_targets_ct_mm(bone.volume);
        pelvis.bones.push_back(std::move(bone));
    }
    return pelvis;
}

/// Uniform in each component, about a point.
RigidTransform motion(Random& random, double mm, double deg, const Eigen::Vector3d& centre) {
    Twist twist;
    for (int i = 0; i < 6; ++i) {
        twist[i] = (i < 3 ? deg * std::numbers::pi / 180 : mm) * random.uniform(-1, 1);
    }
    return exp_about(twist, centre);
}

void add(Image& sum, const Image& image, float factor) {
    for (std::size_t i = 0; i < sum.pixels.size(); ++i) sum.pixels[i] += factor * image.pixels[i];
}

/// What one bone adds to a view where it is.
Image shadow(const Bone& bone, const View& view, const RigidTransform& world_from_ct, Backend& backend) {
    if (!bone.solid.solids.empty()) return exact_drr(bone.solid, view.geometry, world_from_ct);
    View bare = view;
    bare.image = {};
    const double step_mm = 0.4 * bone.fine.grid.spacing_mm.minCoeff();
    const auto session = backend.prepare({bone.fine, {&bare, 1}, {Projector::trilinear, step_mm}, {}});
    return session->render(world_from_ct, 0);
}

std::vector<View> xrays(const Spine& spine, const std::vector<RigidTransform>& truth, const Settings& settings,
                        int seed, Backend& backend) {
    std::vector<View> views = test::biplane_views(256, settings.hemipelves.empty() ? 220 : 400);
    if (settings.views == 1) views.erase(views.begin() + (settings.hemipelves.empty() ? 1 : 0));
    for (std::size_t v = 0; v < views.size(); ++v) {
        View& view = views[v];
        view.image = spine.whole.solids.empty() ? Image(256, 256) : exact_drr(spine.whole, view.geometry, {});
        for (std::size_t k = 0; k < spine.bones.size(); ++k) {
            if (!spine.whole.solids.empty()) add(view.image, shadow(spine.bones[k], view, {}, backend), -1);
            add(view.image, shadow(spine.bones[k], view, truth[k], backend), 1);
        }
        if (settings.photons > 0) view.image = with_photon_noise(view.image, settings.photons, 100 * seed + v);
    }
    return views;
}

struct Trial {
    std::vector<RigidTransform> truth, starts;
};

Trial make_trial(const Spine& spine, const Settings& settings, int seed) {
    Random random(1000 + seed);
    Trial trial;
    for (const Bone& bone : spine.bones) {
        const Eigen::Vector3d centre = targets_centre_mm(bone.targets);
        trial.truth.push_back(motion(random, settings.moved, settings.moved, centre));
        double off_mm = 0;
        do {
            trial.starts.resize(trial.truth.size());
            trial.starts.back() = motion(random, 1.6 * settings.off_mm, 8, centre) * trial.truth.back();
            off_mm = mean_target_error_mm(trial.starts.back(), trial.truth.back(), bone.targets);
        } while (!(off_mm > settings.off_mm && off_mm < 2 * settings.off_mm));
    }
    return trial;
}

struct Tally {
    int objects = 0, within = 0, ok = 0, wrong_but_ok = 0;
    void count(double error_mm, bool is_ok) {
        ++objects;
        within += error_mm < 0.5;
        ok += is_ok;
        wrong_but_ok += is_ok && error_mm > 1;
    }
    void print(const char* name) const {
        std::cout << name << ": below 0.5 mm " << within << " of " << objects << ", called ok " << ok
                  << ", of these off by more than 1 mm " << wrong_but_ok << "\n";
    }
};

void run_trial(const Spine& spine, const Settings& settings, int seed, Backend& backend, Tally& together,
               Tally& alone) {
    const Trial trial = make_trial(spine, settings, seed);
    const std::vector<View> views = xrays(spine, trial.truth, settings, seed, backend);
    std::vector<SceneObject> objects;
    for (std::size_t k = 0; k < spine.bones.size(); ++k) {
        objects.push_back({"V" + std::to_string(k + 1), spine.bones[k].volume, trial.starts[k]});
    }
    if (settings.rest != "none") {
        objects.push_back({"rest", spine.rest, {}, settings.rest == "still" ? Mobility::stays : Mobility::moves, true});
    }
    const SceneResult scene = register_scene(objects, views, {}, backend);
    std::cout << "trial " << seed << ": moving together " << scene.together_s << " s, all " << scene.total_s
              << " s, cost " << scene.cost_final << ", iterations " << scene.iterations << "\n";
    for (const std::string& decision : scene.decisions) std::cout << "  " << decision << "\n";
    for (std::size_t k = 0; k < spine.bones.size(); ++k) {
        const auto error_mm = [&](const RigidTransform& pose) {
            return mean_target_error_mm(pose, trial.truth[k], spine.bones[k].targets);
        };
        const RegistrationResult& found = scene.objects[k];
        together.count(error_mm(found.world_from_ct), found.ok);
        std::cout << "  " << objects[k].name << " start " << error_mm(trial.starts[k]) << " together "
                  << error_mm(scene.together[k]) << " found " << error_mm(found.world_from_ct) << " expected "
                  << found.confidence.rim_mm << " cost " << found.cost_final
                  << (found.ok ? " ok" : " doubtful: " + found.reasons.front());
        if (settings.alone) {
            const RegistrationResult one =
                register_volume(spine.bones[k].volume, views, trial.starts[k], {.content = Content::part}, backend);
            alone.count(error_mm(one.world_from_ct), one.ok);
            std::cout << " | alone " << error_mm(one.world_from_ct) << (one.ok ? " ok " : " doubtful ") << one.total_s
                      << " s";
        }
        std::cout << std::endl;
    }
}

}  // namespace
}  // namespace raylign::detail::bench

int main(int argc, char** argv) {
    using namespace raylign::detail::bench;
    Settings settings;
    CLI::App app("Several bones at once: the spine phantom");
    app.add_option("--trials", settings.trials);
    app.add_option("--first", settings.first);
    app.add_option("--rest", settings.rest);
    app.add_option("--views", settings.views);
    app.add_option("--objects", settings.objects);
    app.add_option("--photons", settings.photons);
    app.add_option("--moved", settings.moved);
    app.add_option("--off", settings.off_mm);
    app.add_option("--hemipelves", settings.hemipelves);
    app.add_flag("--alone", settings.alone);
    CLI11_PARSE(app, argc, argv);
    const Spine spine =
        settings.hemipelves.empty() ? make_spine(settings.objects) : make_hemipelves(settings.hemipelves);
    const auto backend = raylign::create_backend("cpu").backend;
    Tally together, alone;
    for (int i = 0; i < settings.trials; ++i) {
        run_trial(spine, settings, settings.first + i, *backend, together, alone);
    }
    together.print("together");
    if (settings.alone) alone.print("alone");
}

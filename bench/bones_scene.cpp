#include "bench/bones_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/random.h"
#include "core/image/composed.h"
#include "core/image/pyramid.h"
#include "core/image/region.h"
#include "core/io/volumes/labelled_objects.h"
#include "raylign/backends.h"
#include "raylign/intensity.h"
#include "raylign/io/volume.h"
#include "raylign/targets.h"
#include "raylign/xray.h"
#include "tests/support/scenes.h"
#include "tests/support/xrays.h"

namespace raylign::detail::bench {
namespace {

const Eigen::Vector3d kExtent_mm = Eigen::Vector3d::Constant(200);
constexpr double kBone_hu = 150;

void subtract(Volume& from, const Volume& part) {
    for (std::size_t i = 0; i < from.attenuation_per_mm.size(); ++i) {
        from.attenuation_per_mm[i] -= part.attenuation_per_mm[i];
    }
}

Body make_spine(const BonesSettings& settings) {
    Body spine{.whole = spine_phantom(kExtent_mm)};
    const VoxelGrid fine_grid = centred_grid({200, 200, 200}, {1, 1, 1});
    spine.fine_rest = voxelise(spine.whole, fine_grid, 2);
    spine.rest = voxelise(spine.whole, centred_grid({100, 100, 100}, {2, 2, 2}), 3);
    for (int level = 0; level < settings.objects; ++level) {
        Bone bone{.name = "V" + std::to_string(level + 1), .solid = spine_vertebra(kExtent_mm, level)};
        const Volume fine = voxelise(bone.solid, fine_grid, 3);
        bone.volume = crop(fine, box_of_object(fine));
        bone.fine = bone.volume;
        bone.targets = default_targets_ct_mm(bone.volume);
        subtract(spine.fine_rest, fine);
        subtract(spine.rest, voxelise(bone.solid, spine.rest.grid, 3));
        spine.bones.push_back(std::move(bone));
    }
    spine.lone_view = 0;
    return spine;
}

Volume halved(Volume volume, int times) {
    for (int i = 0; i < times; ++i) volume = half_resolution(volume);
    return volume;
}

void add_bone(Body& body, const std::string& name, Volume fine, int halvings) {
    Bone bone{.name = name, .fine = crop(fine, box_of_object(fine))};
    bone.volume = halved(bone.fine, halvings);
    bone.targets = default_targets_ct_mm(bone.volume);
    body.bones.push_back(std::move(bone));
}

/// The halves of a pelvis, cut at the middle column; no soft tissue.
Body make_hemipelves(const BonesSettings& settings) {
    const Volume whole = read_volume(settings.hemipelves, {.object = {.bone_threshold_hu = kBone_hu}}).volume;
    Body pelvis{.field_mm = 400, .lone_view = 1};
    for (int half = 0; half < 2; ++half) {
        Volume side = whole;
        const int columns = side.grid.size.x();
        for (std::size_t i = 0; i < side.attenuation_per_mm.size(); ++i) {
            const bool is_right = static_cast<int>(i % columns) < columns / 2;
            if (is_right != (half == 0)) side.attenuation_per_mm[i] = 0;
        }
        add_bone(pelvis, half == 0 ? "right" : "left", std::move(side), settings.halvings);
    }
    return pelvis;
}

void aim_at_bones(Body& body) {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const Bone& bone : body.bones) centre += targets_centre_mm(bone.targets) / double(body.bones.size());
    body.pose = test::oblique_pose() * RigidTransform::translate(-centre);
}

void take_rest(Body& body, Volume rest, const BonesSettings& settings) {
    body.rest = halved(rest, settings.halvings);
    body.fine_rest = std::move(rest);
}

/// vertebra-2 and vertebra-3 of raylign_robustness, boxes of voxels; the rest keeps water in their place.
Body make_chest(const BonesSettings& settings) {
    Volume rest = read_volume(settings.chest).volume;
    const float bone = attenuation_from_hu(kBone_hu, hu_presets().front());
    Body chest{.field_mm = 300};
    static constexpr std::array<std::array<int, 2>, 2> kSlices{{{39, 50}, {50, 63}}};
    for (std::size_t k = 0; k < kSlices.size(); ++k) {
        const VoxelBox box{{100, 165, kSlices[k][0]}, {140, 218, kSlices[k][1]}};
        Volume own = crop(rest, box);
        contrast_above(own, bone);
        for (int z = box.begin.z(); z < box.end.z(); ++z) {
            for (int y = box.begin.y(); y < box.end.y(); ++y) {
                for (int x = box.begin.x(); x < box.end.x(); ++x) {
                    const std::size_t row = static_cast<std::size_t>(z) * rest.grid.size.y() + y;
                    float& value = rest.attenuation_per_mm[row * rest.grid.size.x() + x];
                    value = std::min(value, bone);
                }
            }
        }
        add_bone(chest, "vertebra-" + std::to_string(k + 2), std::move(own), 0);
    }
    chest.fine_rest = rest;
    chest.rest = half_resolution(rest);
    aim_at_bones(chest);
    return chest;
}

/// Objects of a CT's label map, and the rest of it.
Body make_labelled(const BonesSettings& settings) {
    const Volume ct = read_volume(settings.chest).volume;
    ObjectCut cut{settings.labels, {}, {}, attenuation_from_hu(0, hu_presets().front()), true};
    for (const std::string& name : settings.names) cut.objects.push_back({name, {name}});
    LabelledObjects found = cut_objects(ct, cut);
    Body body{.field_mm = 300};
    for (std::size_t k = 0; k < found.names.size(); ++k) {
        add_bone(body, found.names[k], std::move(found.objects[k]), settings.halvings);
    }
    take_rest(body, std::move(*found.rest), settings);
    aim_at_bones(body);
    return body;
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

Image fine_drr(const Volume& volume, const View& view, const RigidTransform& world_from_ct, Backend& backend) {
    View bare = view;
    bare.image = {};
    const double step_mm = 0.4 * volume.grid.spacing_mm.minCoeff();
    return backend.prepare({volume, {&bare, 1}, {Projector::trilinear, step_mm}, {}})->render(world_from_ct, 0);
}

Image ideal_line_integral(const Body& body, const View& view, const std::vector<RigidTransform>& truth,
                          Backend& backend) {
    Image sum(256, 256);
    if (!body.whole.solids.empty()) {
        sum = exact_drr(body.whole, view.geometry, {});
        for (std::size_t k = 0; k < body.bones.size(); ++k) {
            add(sum, exact_drr(body.bones[k].solid, view.geometry, {}), -1);
            add(sum, exact_drr(body.bones[k].solid, view.geometry, truth[k]), 1);
        }
        return sum;
    }
    if (body.fine_rest.grid.size.x() > 0) add(sum, fine_drr(body.fine_rest, view, body.pose, backend), 1);
    for (std::size_t k = 0; k < body.bones.size(); ++k) {
        add(sum, fine_drr(body.bones[k].fine, view, truth[k], backend), 1);
    }
    return sum;
}

/// The half size of a box about the origin that holds the body and every bone where it is: what lies outside of a grid
/// is in no X-ray.
Eigen::Vector3d reach_mm(const Body& body, const std::vector<RigidTransform>& truth, const Eigen::Vector3d& half_mm) {
    Eigen::Vector3d reach = half_mm;
    for (std::size_t k = 0; k < body.bones.size(); ++k) {
        const VoxelGrid& grid = body.bones[k].fine.grid;
        for (int corner = 0; corner < 8; ++corner) {
            const Eigen::Vector3i side(corner & 1, corner >> 1 & 1, corner >> 2);
            const Eigen::Vector3d voxel = side.cwiseProduct(grid.size).cast<double>();
            reach = reach.cwiseMax((inverse(body.pose) * truth[k] * grid.ct_from_voxel(voxel)).cwiseAbs());
        }
    }
    return reach;
}

/// Water in the shape of a body of this width and depth, about the origin, for bones that have none around them: an
/// X-ray model's detector would be saturated beside them.
Volume water_body(const Body& body, const std::vector<RigidTransform>& truth, const std::vector<double>& body_mm) {
    constexpr double kHeight_mm = 300;
    const double spacing_mm = body.bones.front().fine.grid.spacing_mm.minCoeff();
    const Eigen::Vector3d half_mm = Eigen::Vector3d(body_mm[0], body_mm[1], kHeight_mm) / 2;
    const Eigen::Vector3d reach = reach_mm(body, truth, half_mm);
    Volume water{
        centred_grid((2 * reach / spacing_mm).array().ceil().cast<int>(), Eigen::Vector3d::Constant(spacing_mm)), {}};
    const float per_mm = attenuation_from_hu(0, hu_presets().front());
    for (int z = 0; z < water.grid.size.z(); ++z) {
        for (int y = 0; y < water.grid.size.y(); ++y) {
            for (int x = 0; x < water.grid.size.x(); ++x) {
                const Eigen::Vector3d at = water.grid.ct_from_voxel({double(x), double(y), double(z)});
                const bool is_inside =
                    std::hypot(at.x() / half_mm.x(), at.y() / half_mm.y()) < 1 && std::abs(at.z()) < half_mm.z();
                water.attenuation_per_mm.push_back(is_inside ? per_mm : 0);
            }
        }
    }
    return water;
}

/// The fine grids as one, for an X-ray model.
Volume moved_body(const Body& body, const std::vector<RigidTransform>& truth, const std::vector<double>& body_mm) {
    Volume whole = body.fine_rest;
    if (whole.grid.size.x() == 0) whole = water_body(body, truth, body_mm);
    for (std::size_t k = 0; k < body.bones.size(); ++k) {
        add_resampled(whole, body.pose, body.bones[k].fine, truth[k]);
    }
    return whole;
}

}  // namespace

Body make_body(const BonesSettings& settings) {
    Body body = !settings.hemipelves.empty() ? make_hemipelves(settings)
                : !settings.labels.empty()   ? make_labelled(settings)
                : !settings.chest.empty()    ? make_chest(settings)
                                             : make_spine(settings);
    if (settings.joint.empty()) return body;
    for (std::size_t k = 1; k < body.bones.size(); ++k) {
        body.joints.push_back({k - 1, k, settings.joint[0], settings.joint[1]});
    }
    return body;
}

BonesTrial make_trial(const Body& body, const BonesSettings& settings, int seed) {
    Random random(1000 + seed);
    BonesTrial trial;
    for (const Bone& bone : body.bones) {
        const Eigen::Vector3d centre = targets_centre_mm(bone.targets);
        trial.truth.push_back(motion(random, settings.moved, settings.moved, body.pose * centre) * body.pose);
        double off_mm = 0;
        do {
            trial.starts.resize(trial.truth.size());
            trial.starts.back() =
                motion(random, 1.6 * settings.off_mm, 8, trial.truth.back() * centre) * trial.truth.back();
            off_mm = mean_target_error_mm(trial.starts.back(), trial.truth.back(), bone.targets);
        } while (!(off_mm > settings.off_mm && off_mm < 2 * settings.off_mm));
    }
    return trial;
}

std::vector<View> take_xrays(const Body& body, const std::vector<RigidTransform>& truth, const BonesSettings& settings,
                             int seed, Backend& backend) {
    std::vector<View> views = test::biplane_views(256, body.field_mm);
    if (settings.views == 1) views = {views[static_cast<std::size_t>(body.lone_view)]};
    const bool is_ideal = settings.xray == "ideal";
    const Volume moved = is_ideal ? Volume{} : moved_body(body, truth, settings.body_mm);
    std::vector<XrayExposure> exposures;
    if (!is_ideal) {
        exposures = expose(xray_model(settings.xray), moved, hu_presets().front(), views, body.pose, backend);
    }
    for (std::size_t v = 0; v < views.size(); ++v) {
        const std::uint64_t noise = 100 * static_cast<std::uint64_t>(seed) + v;
        if (!is_ideal) {
            test::take_counts(views[v], detected(xray_model(settings.xray), exposures[v], noise));
            continue;
        }
        views[v].image = ideal_line_integral(body, views[v], truth, backend);
        if (settings.photons > 0) views[v].image = with_photon_noise(views[v].image, settings.photons, noise);
    }
    return views;
}

}  // namespace raylign::detail::bench

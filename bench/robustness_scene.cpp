#include "bench/robustness_scene.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string_view>
#include <utility>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/evaluation/mismatch.h"
#include "core/image/region.h"
#include "raylign/backends.h"
#include "raylign/simulate.h"
#include "raylign/targets.h"
#include "raylign/xray.h"
#include "tests/support/scenes.h"
#include "tests/support/xrays.h"

namespace raylign::detail::bench {

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

namespace {

/// Photons that an empty pixel counts, of the ideal detector. Through 300 mm of chest 1 in 1000 comes out.
constexpr double kPhotons = 20000, kPhotonsPart = 1e6;
constexpr float kBone_per_mm = 0.0237F;  // 150 HU
constexpr double kPartField = 0.75;      // of the field
constexpr double kKeptLength = 0.6;      // of a truncated CT

/// As `--object voxels:... --bone-threshold 150` reads it.
Volume vertebra(const Volume& ct, const VoxelBox& box) {
    Volume bone = crop(ct, box);
    contrast_above(bone, kBone_per_mm);
    fade_sides(bone, 4);
    return bone;
}

/// The middle of the CT along its third axis.
Volume truncated(const Volume& ct) {
    const int n = ct.grid.size.z(), kept = std::max(1, static_cast<int>(std::lround(kKeptLength * n)));
    VoxelBox box{{0, 0, (n - kept) / 2}, ct.grid.size};
    box.end.z() = box.begin.z() + kept;
    return crop(ct, box);
}

std::vector<View> views_of(const SceneSettings& settings, double field_mm) {
    std::vector<View> views{{"A", test::c_arm_view(0, settings.pixels, field_mm), {}, {}},
                            {"B", test::c_arm_view(settings.angle_deg, settings.pixels, field_mm), {}, {}}};
    views.resize(settings.views);
    return views;
}

/// Another patient on the table: turned by up to 12 degrees and moved by up to 15 mm along each axis.
RigidTransform pose_number(int number) {
    if (number == 0) return test::oblique_pose();
    Random random(number);
    Twist twist;
    twist << std::numbers::pi / 15 * std::cbrt(random.uniform()) * random.direction(), random.uniform(-15, 15),
        random.uniform(-15, 15), random.uniform(-15, 15);
    return exp(twist) * test::oblique_pose();
}

struct IdealDetector {
    bool scatters = false;
    double photons = 0;  ///< of an empty pixel; 0 = no noise
};

Image ideal_xray(const IdealDetector& detector, int pixels, const Image& line_integral, std::uint64_t seed) {
    Image image = line_integral;
    if (detector.scatters) image = with_scatter(image, 0.3, pixels / 10.0);
    return detector.photons > 0 ? with_photon_noise(image, detector.photons, seed) : image;
}

/// The X-rays of `actual` at `pose`: by the model, or what the scene's ideal detector makes of them.
void take_xrays(Scene& scene, const Volume& actual, const RigidTransform& pose, const SceneSettings& settings,
                const IdealDetector& ideal) {
    const auto backend = create_backend("cpu").backend;
    const std::uint64_t seed = 100 + 10 * settings.pose;
    if (settings.xray == "ideal") {
        const RenderSettings fine{Projector::trilinear, 0.4 * actual.grid.spacing_mm.minCoeff()};
        const auto session = backend->prepare({actual, scene.views, fine, {}});
        for (std::size_t v = 0; v < scene.views.size(); ++v) {
            scene.views[v].image = ideal_xray(ideal, settings.pixels, session->render(pose, v), seed + v);
        }
        return;
    }
    const XrayModel& model = xray_model(settings.xray);
    const auto exposures = expose(model, actual, hu_presets().front(), scene.views, pose, *backend);
    for (std::size_t v = 0; v < scene.views.size(); ++v) {
        test::take_counts(scene.views[v], detected(model, exposures[v], seed + v));
    }
}

/// Exact X-rays of the spine phantom, or a model's of its voxels; one of its vertebrae is registered.
Scene make_spine(const SceneSettings& settings) {
    const Eigen::Vector3d extent_mm = Eigen::Vector3d::Constant(200);
    const VoxelGrid grid = centred_grid({200, 200, 200}, {1, 1, 1});
    Scene scene{.name = "spine",
                .moving = voxelise(spine_vertebra(extent_mm, 2), grid, 3),
                .views = views_of(settings, kPartField * settings.field_mm),
                .truth = pose_number(settings.pose),
                .success_mm = 2};
    scene.targets = default_targets_ct_mm(scene.moving);
    const Phantom spine = spine_phantom(extent_mm);
    if (settings.xray != "ideal") {
        take_xrays(scene, voxelise(spine, grid, 3), scene.truth, settings, {});
        return scene;
    }
    for (std::size_t v = 0; v < scene.views.size(); ++v) {
        const Image image = exact_drr(spine, scene.views[v].geometry, scene.truth);
        scene.views[v].image = ideal_xray({true, kPhotonsPart}, settings.pixels, image, 100 + 10 * settings.pose + v);
    }
    return scene;
}

/// "wrong-view-1" turns the second camera by 1 degree about the isocentre, "wrong-view-2mm" moves it by 2 mm, both
/// along an oblique axis. False for another name.
bool mistake_second_view(const std::string& name, std::vector<View>& views) {
    constexpr std::string_view kPrefix = "wrong-view-";
    if (!name.starts_with(kPrefix)) return false;
    std::size_t used = 0;
    const std::string amount = name.substr(kPrefix.size());
    const double value =
        amount.empty() || !std::isdigit(static_cast<unsigned char>(amount[0])) ? 0 : std::stod(amount, &used);
    const std::string unit = amount.substr(used);
    if (!(value > 0 && value <= 90) || (!unit.empty() && unit != "mm")) {
        throw bad_value("scene", name, "wrong-view-N or wrong-view-Nmm with N in (0, 90]");
    }
    if (views.size() < 2) throw Error("scene " + name + " needs two views");
    const Eigen::Vector3d axis = Eigen::Vector3d(1, -1, 1).normalized();
    Twist twist = Twist::Zero();
    if (unit.empty()) twist.head<3>() = value * std::numbers::pi / 180 * axis;
    if (!unit.empty()) twist.tail<3>() = value * axis;
    views[1].geometry.camera_from_world = views[1].geometry.camera_from_world * exp(twist);
    return true;
}

/// "wrong-sdd-5" has both views believe an sdd 5 % too long. False for another name.
bool mistake_sdd(const std::string& name, std::vector<View>& views) {
    constexpr std::string_view kPrefix = "wrong-sdd-";
    if (!name.starts_with(kPrefix)) return false;
    double percent = 0;
    if (std::sscanf(name.c_str() + kPrefix.size(), "%lf", &percent) != 1 || !(std::abs(percent) <= 50)) {
        throw bad_value("scene", name, "wrong-sdd-N with N in [-50, 50]");
    }
    for (View& view : views) {
        view.geometry.camera.intrinsics_px.topLeftCorner<2, 2>() *= 1 + percent / 100;
        if (view.geometry.camera.sdd_mm) *view.geometry.camera.sdd_mm *= 1 + percent / 100;
    }
    return true;
}

/// What is registered, where it is no whole CT.
void take_moving(Scene& scene, const Volume& ct) {
    static constexpr std::array<std::pair<std::string_view, std::array<int, 2>>, 5> kVertebrae{
        {{"vertebra-1", {28, 43}},
         {"vertebra-2", {39, 53}},
         {"vertebra-3", {49, 63}},
         {"vertebra-4", {60, 73}},
         {"vertebra-5", {70, 83}}}};
    for (const auto& [name, z] : kVertebrae) {
        if (scene.name == name) scene.moving = vertebra(ct, {{100, 165, z[0]}, {140, 218, z[1]}});
    }
    if (scene.name == "truncated") scene.moving = truncated(ct);
}

bool is_known(const std::string& name) {
    for (const char* known : {"clean", "noise", "scatter", "metal", "truncated", "other"}) {
        if (name == known) return true;
    }
    return name.starts_with("vertebra-") || name.starts_with("wrong-view-") || name.starts_with("wrong-sdd-");
}

}  // namespace

Scene make_scene(const std::string& name, const Volume& ct, const SceneSettings& settings) {
    if (name == "spine") return make_spine(settings);
    if (!is_known(name)) throw bad_value("scene", name, kSceneNames);
    Scene scene{.name = name, .moving = ct};
    take_moving(scene, ct);
    const bool part = name.starts_with("vertebra-");
    if (part && scene.moving.grid.size == ct.grid.size) throw bad_value("scene", name, kSceneNames);
    Volume actual = ct;
    if (name == "metal") put_metal(actual);
    if (name == "other" && !settings.other) throw Error("scene other needs another CT: other=FILE");
    if (name == "other") actual = *settings.other;
    scene.targets = default_targets_ct_mm(scene.moving);
    const Eigen::Vector3d centre = part ? targets_centre_mm(scene.targets) : Eigen::Vector3d(ct.grid.centre_ct_mm());
    scene.truth = pose_number(settings.pose) * RigidTransform::translate(-centre);
    scene.success_mm = part ? 2 : ct.grid.spacing_mm.minCoeff() / 2;
    if (name == "other") scene.success_mm = 0;
    scene.views = views_of(settings, (part ? kPartField : 1) * settings.field_mm);
    // Another CT lies in the views as this one would: the middles of both in one place.
    const RigidTransform pose =
        name != "other" ? scene.truth
                        : scene.truth * RigidTransform::translate(ct.grid.centre_ct_mm() - actual.grid.centre_ct_mm());
    take_xrays(scene, actual, pose, settings,
               {name == "scatter" || name == "metal" || part, name == "clean" ? 0
                                                              : part          ? kPhotonsPart
                                                                              : kPhotons});
    (void)(mistake_second_view(name, scene.views) || mistake_sdd(name, scene.views));
    return scene;
}

}  // namespace raylign::detail::bench

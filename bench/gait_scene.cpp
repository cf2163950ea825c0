#include "bench/gait_scene.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <numbers>
#include <vector>

#include "bench/gait_tally.h"
#include "core/image/region.h"
#include "core/io/images/counts.h"
#include "core/registration/object/pose_space.h"
#include "raylign/backends.h"
#include "raylign/io/pose.h"
#include "raylign/io/views.h"
#include "raylign/io/volume.h"
#include "raylign/targets.h"
#include "raylign/xray.h"
#include "tests/support/scenes.h"

namespace raylign::detail::bench {
namespace {

constexpr double kScale = 0.5, kBone_hu = 150;

/// The field at a point of ct: trilinear, 0 outside.
float sample(const Volume& volume, const Eigen::Vector3d& x_ct) {
    const Eigen::Vector3d voxel = volume.grid.voxel_from_ct(x_ct);
    const Eigen::Vector3i low = voxel.array().floor().cast<int>();
    if (low.minCoeff() < 0 || (low.array() >= volume.grid.size.array() - 1).any()) return 0;
    const Eigen::Vector3d t = voxel - low.cast<double>();
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const int x = corner & 1, y = corner >> 1 & 1, z = corner >> 2;
        const double weight = (x ? t.x() : 1 - t.x()) * (y ? t.y() : 1 - t.y()) * (z ? t.z() : 1 - t.z());
        sum += weight * volume(low.x() + x, low.y() + y, low.z() + z);
    }
    return static_cast<float>(sum);
}

/// Half of the pelvis, by what it exceeds soft tissue by, in half its size.
Volume bone_of(const std::string& file, bool is_right) {
    Volume volume = read_volume(file, {.object = {.bone_threshold_hu = kBone_hu}}).volume;
    const int columns = volume.grid.size.x();
    for (std::size_t i = 0; i < volume.attenuation_per_mm.size(); ++i) {
        const bool of_right = static_cast<int>(i % columns) < columns / 2;
        if (of_right != is_right) volume.attenuation_per_mm[i] = 0;
    }
    volume.grid.origin_mm = kScale * (volume.grid.origin_mm - volume.grid.centre_ct_mm());
    volume.grid.spacing_mm *= kScale;
    return crop(volume, box_of_object(volume));
}

/// The same on a cube of n^3 voxels.
Volume cube_of(const Volume& bone, int n) {
    const Eigen::Vector3d extent_mm = bone.grid.spacing_mm.cwiseProduct(bone.grid.size.cast<double>());
    Volume cube;
    cube.grid = centred_grid(Eigen::Vector3i::Constant(n), Eigen::Vector3d::Constant(extent_mm.maxCoeff() / n));
    cube.grid.origin_mm += bone.grid.centre_ct_mm();
    for (int z = 0; z < n; ++z) {
        for (int y = 0; y < n; ++y) {
            for (int x = 0; x < n; ++x) {
                cube.attenuation_per_mm.push_back(sample(bone, cube.grid.ct_from_voxel({1. * x, 1. * y, 1. * z})));
            }
        }
    }
    return cube;
}

}  // namespace

RigidTransform gait_pose(int frame, std::size_t bone, const Eigen::Vector3d& centre_ct_mm, bool is_joined) {
    const double of_both = 2 * std::numbers::pi * frame / kPeriod, own = of_both + 2.1 * static_cast<double>(bone);
    Twist twist;
    twist << 25 * std::sin(own), 7 * std::sin(2 * own + 0.4), 5 * std::cos(own + 1), 0, 0, 0;
    twist *= std::numbers::pi / 180;
    const double phase = is_joined ? of_both : own;
    twist.tail<3>() << 4 * std::cos(phase + 0.3), 6 * std::sin(phase + 2), 5 * std::sin(2 * phase);
    if (is_joined) twist.tail<3>() += Eigen::Vector3d(std::sin(3 * own), std::cos(3 * own + 1), std::sin(2 * own + 2));
    return exp_about(twist, centre_ct_mm);
}

namespace {

/// Both bones where they are, in an elliptic cylinder of water.
Volume body_at(const std::vector<Volume>& bones, const std::vector<RigidTransform>& world_from_ct) {
    Volume body;
    body.grid = centred_grid({400, 300, 340}, Eigen::Vector3d::Constant(0.5));
    const double water = hu_presets().front().water_per_mm;
    std::vector<RigidTransform> ct_from_world;
    for (const RigidTransform& pose : world_from_ct) ct_from_world.push_back(inverse(pose));
    const Eigen::Vector3d half_mm = 0.475 * body.grid.spacing_mm.cwiseProduct(body.grid.size.cast<double>());
    for (int z = 0; z < body.grid.size.z(); ++z) {
        for (int y = 0; y < body.grid.size.y(); ++y) {
            for (int x = 0; x < body.grid.size.x(); ++x) {
                const Eigen::Vector3d x_world = body.grid.ct_from_voxel({1. * x, 1. * y, 1. * z});
                const bool is_inside = x_world.cwiseQuotient(half_mm).head<2>().squaredNorm() < 1;
                double value = is_inside ? water : 0;
                for (std::size_t b = 0; b < bones.size(); ++b) value += sample(bones[b], ct_from_world[b] * x_world);
                body.attenuation_per_mm.push_back(static_cast<float>(value));
            }
        }
    }
    return body;
}

std::vector<View> cameras(int pixels) {
    return {{"cam1", test::c_arm_view(-30, pixels, 200), {}, {}}, {"cam2", test::c_arm_view(40, pixels, 200), {}, {}}};
}

std::string frame_name(const std::string& camera, int frame) {
    char number[16];
    std::snprintf(number, sizeof number, "%04d", frame);
    return camera + "/" + number + ".tif";
}

std::vector<RigidTransform> poses_at(int frame, const std::vector<Eigen::Vector3d>& centres_mm, bool is_joined) {
    std::vector<RigidTransform> poses;
    for (std::size_t b = 0; b < centres_mm.size(); ++b) {
        poses.push_back(gait_pose(frame, b, centres_mm[b], is_joined));
    }
    return poses;
}

/// With quantum noise of its own.
void write_frame(const std::filesystem::path& folder, int frame, const std::vector<View>& views,
                 const std::vector<XrayExposure>& exposures) {
    for (std::size_t v = 0; v < views.size(); ++v) {
        const RawXray counts =
            detected(xray_model("biplane-lab"), exposures[v], static_cast<std::uint64_t>(2 * frame) + v);
        write_counts(folder / frame_name(views[v].name, frame), counts.image, counts.max_representable);
    }
}

}  // namespace

void make_gait(const GaitSettings& settings) {
    const std::filesystem::path folder = settings.folder;
    std::vector<Volume> bones;
    std::vector<Eigen::Vector3d> centres_mm;
    std::vector<View> views = cameras(settings.pixels);
    for (const View& view : views) std::filesystem::create_directories(folder / view.name);
    for (std::size_t b = 0; b < kBones.size(); ++b) {
        bones.push_back(bone_of(settings.file, b == 1));
        const Volume cube = cube_of(bones[b], settings.voxels);
        centres_mm.push_back(object_extent(cube).centre_ct_mm);
        write_volume(folder / (std::string(kBones[b]) + ".nii.gz"), cube);
        const RigidTransform start =
            perturbed_start(gait_pose(1, b, centres_mm[b], settings.is_joined), default_targets_ct_mm(cube), 3, 1 + b);
        write_pose(folder / ("start_" + std::string(kBones[b]) + ".json"), start);
    }
    IntensitySettings intensity;
    intensity.kind = IntensityKind::transmission;
    intensity.polarity = Polarity::bone_dark;
    intensity.auto_mask = true;
    write_views(folder / "views.json", views, {frame_name("cam1", 1), frame_name("cam2", 1)}, intensity);
    const auto backend = create_backend("cpu").backend;
    for (int frame = settings.first; frame <= std::min(settings.frames, kPeriod); ++frame) {
        const std::vector<XrayExposure> exposures =
            expose(xray_model("biplane-lab"), body_at(bones, poses_at(frame, centres_mm, settings.is_joined)),
                   hu_presets().front(), views, {}, *backend, Projector::trilinear);
        for (int again = frame; again <= settings.frames; again += kPeriod) {
            write_frame(folder, again, views, exposures);
        }
        std::cout << "frame " << frame << " of " << std::min(settings.frames, kPeriod) << std::endl;
    }
}

}  // namespace raylign::detail::bench

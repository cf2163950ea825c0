// A simulated sequence as biplane laboratories record it, to measure `raylign track` on: two bones of a CT (the halves
// of a pelvis at half their size, about that of a knee's bones) move as in gait, each by its own motion, in a body of
// water; two views of 512^2 pixels, 70 degrees apart, with spectrum, scatter, blur, noise and 8 bits of the model
// biplane-lab.
//   raylign_gait make FOLDER PELVIS [--first N] [--frames N] [--voxels N] [--pixels N]
//   raylign_gait judge FOLDER TRAJECTORY [--against TRAJECTORY] [--seconds S] [--row NAME] [--json FILE]
// make    leaves views.json, CAMERA/NNNN.tif, BONE.nii.gz (1/mm), start_BONE.json (3 mm off) and truth.csv
// judge   prints what a trajectory.csv of it is worth: against the truth, and how far it is from another trajectory
// The X-rays are rendered from a grid of their own, in which both bones lie as they have moved.

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>
#include <numbers>

#include "bench/record.h"
#include "core/base/median.h"
#include "core/image/region.h"
#include "core/io/images/counts.h"
#include "core/registration/object/pose_space.h"
#include "raylign/backends.h"
#include "raylign/io/pose.h"
#include "raylign/io/trajectory.h"
#include "raylign/io/views.h"
#include "raylign/io/volume.h"
#include "raylign/targets.h"
#include "raylign/xray.h"
#include "tests/support/scenes.h"

namespace raylign::detail::bench {
namespace {

constexpr double kScale = 0.5, kBone_hu = 150, kPeriod = 100;  // frames a step
const std::array<const char*, 2> kBones{"left", "right"};

struct Settings {
    std::string folder, file, against, row = "track";
    int first = 1, frames = 30, voxels = 256, pixels = 512;
    double seconds = 0;
};

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

/// Flexion and what goes with it: up to 25 degrees and 10 mm, smooth, at most 1.6 degrees and 0.7 mm from frame to
/// frame.
RigidTransform pose_at(double frame, std::size_t bone, const Eigen::Vector3d& centre_mm) {
    const double phase = 2 * std::numbers::pi * frame / kPeriod + 2.1 * static_cast<double>(bone);
    Twist twist;
    twist << 25 * std::sin(phase), 7 * std::sin(2 * phase + 0.4), 5 * std::cos(phase + 1), 0, 0, 0;
    twist *= std::numbers::pi / 180;
    twist.tail<3>() << 4 * std::cos(phase + 0.3), 6 * std::sin(phase + 2), 5 * std::sin(2 * phase);
    return exp_about(twist, centre_mm);
}

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

std::vector<RigidTransform> poses_at(int frame, const std::vector<Eigen::Vector3d>& centres_mm) {
    std::vector<RigidTransform> poses;
    for (std::size_t b = 0; b < centres_mm.size(); ++b) poses.push_back(pose_at(frame, b, centres_mm[b]));
    return poses;
}

void write_truth(const std::filesystem::path& file, const std::vector<Eigen::Vector3d>& centres_mm, int frames) {
    std::ofstream truth(file);
    truth << trajectory_header(std::vector<std::string>{"cam1", "cam2"});
    for (int frame = 1; frame <= frames; ++frame) {
        const std::vector<RigidTransform> poses = poses_at(frame, centres_mm);
        for (std::size_t b = 0; b < poses.size(); ++b) {
            const TrackFrame row{
                .frame = frame, .status = TrackStatus::ok, .world_from_ct = poses[b], .view_costs = {0, 0}};
            truth << trajectory_line({kBones[b], row}, 2);
        }
    }
}

void make(const Settings& settings) {
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
            perturbed_start(pose_at(1, b, centres_mm[b]), default_targets_ct_mm(cube), 3, 1 + b);
        write_pose(folder / ("start_" + std::string(kBones[b]) + ".json"), start);
    }
    IntensitySettings intensity;
    intensity.kind = IntensityKind::transmission;
    intensity.polarity = Polarity::bone_dark;
    intensity.auto_mask = true;
    write_views(folder / "views.json", views, {frame_name("cam1", 1), frame_name("cam2", 1)}, intensity);
    write_truth(folder / "truth.csv", centres_mm, settings.frames);
    const auto backend = create_backend("cpu").backend;
    for (int frame = settings.first; frame <= settings.frames; ++frame) {
        const std::vector<XrayExposure> exposures =
            expose(xray_model("biplane-lab"), body_at(bones, poses_at(frame, centres_mm)), hu_presets().front(), views,
                   {}, *backend, Projector::trilinear);
        for (std::size_t v = 0; v < views.size(); ++v) {
            const RawXray counts =
                detected(xray_model("biplane-lab"), exposures[v], static_cast<std::uint64_t>(2 * frame) + v);
            write_counts(folder / frame_name(views[v].name, frame), counts.image, counts.max_representable);
        }
        std::cout << "frame " << frame << " of " << settings.frames << std::endl;
    }
}

double degrees(double rad) { return rad * 180 / std::numbers::pi; }

using Track = std::map<int, TrackFrame>;

Track track_of(const std::string& file, const std::string& bone) {
    Track track;
    for (const TrajectoryRow& row : read_trajectory(file)) {
        if (row.object == bone && pose_of(row.frame)) track[row.frame.frame] = row.frame;
    }
    return track;
}

double rms(const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value * value;
    return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
}

/// Distances of two trajectories.
struct Distances {
    std::vector<double> mm, deg, target_mm;
};

Distances distances(const Track& a, const Track& b, const Volume& bone) {
    Distances all;
    const Eigen::Vector3d centre_mm = object_extent(bone).centre_ct_mm;
    const std::vector<Eigen::Vector3d> targets = default_targets_ct_mm(bone);
    for (const auto& [number, frame] : a) {
        const auto other = b.find(number);
        if (other == b.end()) continue;
        const RigidTransform &x = frame.world_from_ct, &y = other->second.world_from_ct;
        all.mm.push_back((x * centre_mm - y * centre_mm).norm());
        all.deg.push_back(degrees(rotation_angle_rad(x * inverse(y))));
        all.target_mm.push_back(mean_target_error_mm(x, y, targets));
    }
    return all;
}

/// Root mean square second difference of the object's centre, over sqrt(6), without that of the true motion: the noise
/// of one frame along one axis.
double jitter_mm(const Track& track, const Track& truth, const Eigen::Vector3d& centre_mm) {
    std::vector<double> parts;
    for (const auto& [number, frame] : track) {
        if (!track.contains(number - 1) || !track.contains(number + 1)) continue;
        const auto error_at = [&](int n) -> Eigen::Vector3d {
            return track.at(n).world_from_ct * centre_mm - truth.at(n).world_from_ct * centre_mm;
        };
        parts.push_back((error_at(number - 1) - 2 * error_at(number) + error_at(number + 1)).norm() / std::sqrt(18));
    }
    return rms(parts);
}

double most(const std::vector<double>& values) { return values.empty() ? 0 : *std::ranges::max_element(values); }

int judge(const Settings& settings, Record& record) {
    std::size_t rows = 0;
    for (const char* name : kBones) {
        const Volume bone = read_volume(std::filesystem::path(settings.folder) / (std::string(name) + ".nii.gz"),
                                        {.is_attenuation = true})
                                .volume;
        const Track truth = track_of(settings.folder + "/truth.csv", name), track = track_of(settings.file, name);
        rows += track.size();
        if (track.empty()) continue;
        const Distances errors = distances(track, truth, bone);
        std::vector<double> expected;
        int ok = 0, wrong = 0;
        for (std::size_t i = 0; const auto& [number, frame] : track) {
            expected.push_back(frame.expected_error_mm);
            ok += frame.status == TrackStatus::ok;
            wrong += frame.status == TrackStatus::ok && errors.target_mm[i] > 1;
            ++i;
        }
        const double jitter = jitter_mm(track, truth, object_extent(bone).centre_ct_mm);
        std::cout << name << ": " << track.size() << " frames, ok " << ok << " (off by more than 1 mm: " << wrong
                  << "), error at targets median " << median(errors.target_mm) << " most " << most(errors.target_mm)
                  << " mm, turn median " << median(errors.deg) << " most " << most(errors.deg) << " deg, jitter "
                  << jitter << " mm an axis, expected error median " << median(expected) << " mm\n";
        std::vector<Cell> row{settings.row,
                              std::string(name),
                              static_cast<double>(track.size()),
                              ok,
                              wrong,
                              median(errors.target_mm),
                              most(errors.target_mm),
                              median(errors.deg),
                              jitter,
                              median(expected)};
        if (!settings.against.empty()) {
            const Distances apart = distances(track, track_of(settings.against, name), bone);
            std::cout << "  from the other trajectory: median " << median(apart.mm) << " most " << most(apart.mm)
                      << " mm, median " << median(apart.deg) << " most " << most(apart.deg) << " deg\n";
        }
        record.add(std::move(row));
    }
    if (settings.seconds > 0) {
        std::cout << static_cast<double>(rows) / settings.seconds << " bone frames a second, "
                  << settings.seconds / static_cast<double>(rows) << " s each\n";
    }
    record.write();
    return 0;
}

}  // namespace
}  // namespace raylign::detail::bench

int main(int argc, char** argv) {
    using namespace raylign::detail::bench;
    Record record(argc, argv, "A simulated gait sequence",
                  {"track", "bone", "frames", "ok", "ok, off by more than 1 mm", "error, p50 [mm]", "error, most [mm]",
                   "turn, p50 [deg]", "jitter [mm]", "expected error, p50 [mm]"});
    Settings settings;
    CLI::App app("A simulated gait sequence");
    CLI::App& maker = *app.add_subcommand("make");
    maker.add_option("folder", settings.folder)->required();
    maker.add_option("pelvis", settings.file)->required();
    maker.add_option("--frames", settings.frames);
    maker.add_option("--first", settings.first);
    maker.add_option("--voxels", settings.voxels);
    maker.add_option("--pixels", settings.pixels);
    CLI::App& judging = *app.add_subcommand("judge");
    judging.add_option("folder", settings.folder)->required();
    judging.add_option("trajectory", settings.file)->required();
    judging.add_option("--against", settings.against);
    judging.add_option("--seconds", settings.seconds);
    judging.add_option("--row", settings.row);
    app.require_subcommand(1);
    CLI11_PARSE(app, argc, argv);
    if (maker.parsed()) {
        make(settings);
        return 0;
    }
    return judge(settings, record);
}

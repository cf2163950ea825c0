// A simulated sequence as biplane laboratories record it, to measure `raylign track` on: two bones of a CT (the halves
// of a pelvis at half their size, about that of a knee's bones) move as in gait, each by its own motion, in a body of
// water; two views of 512^2 pixels, 70 degrees apart, with spectrum, scatter, blur, noise and 8 bits of the model
// biplane-lab.
//   raylign_gait make FOLDER PELVIS [--first N] [--frames N] [--voxels N] [--pixels N]
//   raylign_gait track FOLDER [--frames N] [--thorough] [--together] [--json FILE]
// make    leaves views.json, CAMERA/NNNN.tif, BONE.nii.gz (1/mm) and start_BONE.json (3 mm off)
// track   follows both bones by the library, each as if the other were not there or both together: processor time a
//         bone and frame, apart from reading, which both share
// The X-rays are rendered from a grid of their own, in which both bones lie as they have moved.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <deque>
#include <filesystem>
#include <iostream>
#include <numbers>

#include "bench/gait_tally.h"
#include "bench/record.h"
#include "core/image/region.h"
#include "core/io/images/counts.h"
#include "core/registration/object/pose_space.h"
#include "core/tracking/company.h"
#include "raylign/backends.h"
#include "raylign/io/frames.h"
#include "raylign/io/pose.h"
#include "raylign/io/views.h"
#include "raylign/io/volume.h"
#include "raylign/targets.h"
#include "raylign/tracking.h"
#include "raylign/xray.h"
#include "tests/support/scenes.h"

namespace raylign::detail::bench {
namespace {

constexpr double kScale = 0.5, kBone_hu = 150;
const std::array<const char*, 2> kBones{"left", "right"};

struct Settings {
    std::string folder, file;
    int first = 1, frames = 30, voxels = 256, pixels = 512;
    bool is_thorough = false, is_together = false;
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

/// With quantum noise of its own.
void write_frame(const std::filesystem::path& folder, int frame, const std::vector<View>& views,
                 const std::vector<XrayExposure>& exposures) {
    for (std::size_t v = 0; v < views.size(); ++v) {
        const RawXray counts =
            detected(xray_model("biplane-lab"), exposures[v], static_cast<std::uint64_t>(2 * frame) + v);
        write_counts(folder / frame_name(views[v].name, frame), counts.image, counts.max_representable);
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
    const auto backend = create_backend("cpu").backend;
    for (int frame = settings.first; frame <= std::min(settings.frames, kPeriod); ++frame) {
        const std::vector<XrayExposure> exposures =
            expose(xray_model("biplane-lab"), body_at(bones, poses_at(frame, centres_mm)), hu_presets().front(), views,
                   {}, *backend, Projector::trilinear);
        for (int again = frame; again <= settings.frames; again += kPeriod) {
            write_frame(folder, again, views, exposures);
        }
        std::cout << "frame " << frame << " of " << std::min(settings.frames, kPeriod) << std::endl;
    }
}

double processor_s() {
    timespec time{};
    (void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

ViewsFile views_of(const Settings& settings) {
    ViewsReadOptions reading;
    reading.images = ReadImages::frames;
    reading.frames = {"cam1=" + settings.folder + "/cam1", "cam2=" + settings.folder + "/cam2"};
    return read_views(std::vector<std::string>{settings.folder + "/views.json"}, reading);
}

/// A bone of the sequence, and what came of it.
struct Followed {
    Followed(const Settings& settings, std::size_t index) : which(index), name(kBones[index]) {
        const Volume bone = read_volume(settings.folder + "/" + name + ".nii.gz", {.is_attenuation = true}).volume;
        window = crop(bone, box_of_object(bone));
        targets = default_targets_ct_mm(bone);
        centre_mm = object_extent(bone).centre_ct_mm;
        start = read_pose(settings.folder + "/start_" + name + ".json");
    }
    std::size_t which;
    std::string name;
    Volume window;
    std::vector<Eigen::Vector3d> targets;
    Eigen::Vector3d centre_mm;
    RigidTransform start;
    Tally tally;
};

TrackOptions options_of(const Settings& settings) {
    TrackOptions options;
    options.quick = !settings.is_thorough;
    return options;
}

std::string title(const Settings& settings, const std::string& bone) {
    return bone + (settings.is_together ? ", together" : "") + (settings.is_thorough ? ", every frame in full" : "");
}

/// One bone followed through the sequence.
void follow_bone(const Settings& settings, std::size_t which, Record& record) {
    Followed bone(settings, which);
    const ViewsFile views = views_of(settings);
    const auto backend = create_backend("cpu").backend;
    Tracker tracker(bone.window, bone.start, options_of(settings), *backend);
    InstantReader reader(views);
    for (const FrameSet& frames : pair_frames(views, {1, settings.frames, 1})) {
        const double begin = processor_s();
        const Instant instant = reader.read(frames);
        const double between = processor_s();
        const TrackFrame found = tracker.feed(frames.number, instant.views);
        bone.tally.read_s.push_back(between - begin);
        bone.tally.seconds.push_back(processor_s() - between);
        bone.tally.take(found, pose_at(frames.number, which, bone.centre_mm), bone.targets);
    }
    bone.tally.tell(title(settings, bone.name), record);
}

/// Both, as `raylign track` does; what they have in common counts half for each.
void follow_both(const Settings& settings, Record& record) {
    std::deque<Followed> bones;
    std::deque<Tracker> trackers;
    std::vector<const Volume*> volumes;
    const auto backend = create_backend("cpu").backend;
    for (std::size_t b = 0; b < kBones.size(); ++b) {
        Followed& bone = bones.emplace_back(settings, b);
        volumes.push_back(&bone.window);
        trackers.emplace_back(bone.window, bone.start, options_of(settings), *backend);
    }
    Company company(volumes, options_of(settings), *backend);
    std::vector<Prospect> prospects(bones.size());
    const ViewsFile views = views_of(settings);
    InstantReader reader(views);
    for (const FrameSet& frames : pair_frames(views, {1, settings.frames, 1})) {
        const double begin = processor_s();
        const Instant instant = reader.read(frames);
        const double read_s = processor_s() - begin;
        std::vector<Expectation> expected;
        for (std::size_t b = 0; b < bones.size(); ++b) {
            expected.push_back({prospects[b].whereabouts(), trackers[b].predicted(frames.number)});
        }
        double shared_s = processor_s();
        company.meet(instant.views, expected, {});
        shared_s = processor_s() - shared_s;
        for (std::size_t b = 0; b < bones.size(); ++b) {
            const double between = processor_s();
            const TrackFrame found = trackers[b].feed(frames.number, company.remainder(instant.views, b));
            prospects[b].remember(found);
            bones[b].tally.read_s.push_back(read_s);
            bones[b].tally.seconds.push_back(processor_s() - between + shared_s / static_cast<double>(bones.size()));
            bones[b].tally.take(found, pose_at(frames.number, b, bones[b].centre_mm), bones[b].targets);
        }
    }
    for (const Followed& bone : bones) bone.tally.tell(title(settings, bone.name), record);
}

}  // namespace
}  // namespace raylign::detail::bench

int main(int argc, char** argv) {
    using namespace raylign::detail::bench;
    Record record(argc, argv, "A simulated gait sequence",
                  {"bone", "frames", "found the quick way", "ok", "ok, off by more than 1 mm",
                   "processor time a frame, p50 [s]", "reading a frame, p50 [s]", "error, p50 [mm]", "error, most [mm]",
                   "turn, p50 [deg]", "expected error, p50 [mm]", "of it noise, rms [mm]",
                   "alike in all steps, rms [mm]", "jitter of the error, an axis [mm]"});
    Settings settings;
    CLI::App app("A simulated gait sequence");
    CLI::App& maker = *app.add_subcommand("make");
    maker.add_option("folder", settings.folder)->required();
    maker.add_option("pelvis", settings.file)->required();
    maker.add_option("--frames", settings.frames);
    maker.add_option("--first", settings.first);
    maker.add_option("--voxels", settings.voxels);
    maker.add_option("--pixels", settings.pixels);
    CLI::App& tracking = *app.add_subcommand("track");
    tracking.add_option("folder", settings.folder)->required();
    tracking.add_option("--frames", settings.frames);
    tracking.add_flag("--thorough", settings.is_thorough);
    tracking.add_flag("--together", settings.is_together);
    app.require_subcommand(1);
    CLI11_PARSE(app, argc, argv);
    if (maker.parsed()) {
        make(settings);
        return 0;
    }
    if (settings.is_together) follow_both(settings, record);
    for (std::size_t bone = 0; bone < kBones.size() && !settings.is_together; ++bone) {
        follow_bone(settings, bone, record);
    }
    record.write();
}

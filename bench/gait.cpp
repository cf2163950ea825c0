// A simulated sequence as biplane laboratories record it, to measure `raylign track` on: two bones of a CT (the halves
// of a pelvis at half their size, about that of a knee's bones) move as in gait, each by its own motion, in a body of
// water; two views of 512^2 pixels, 70 degrees apart, with spectrum, scatter, blur, noise and 8 bits of the model
// biplane-lab.
//   raylign_gait make FOLDER PELVIS [--first N] [--frames N] [--voxels N] [--pixels N] [--joined]
//   raylign_gait track FOLDER [--frames N] [--thorough] [--together] [--json FILE]
//   raylign_gait track FOLDER --joint-gap MM [--frames N] [--together] [--joined] [--json FILE]
// make    leaves views.json, CAMERA/NNNN.tif, BONE.nii.gz (1/mm) and start_BONE.json (3 mm off)
// track   follows both bones by the library, each as if the other were not there or both together: processor time a
//         bone and frame, apart from reading, which both share
//         with --joint-gap in the first view alone, and tells what is off in depth without and with it
// --joined  bones are shifted alike but for a millimetre, as those of a joint are; to be said both times
// The X-rays are rendered from a grid of their own, in which both bones lie as they have moved.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <deque>
#include <iostream>

#include "bench/gait_scene.h"
#include "bench/gait_tally.h"
#include "bench/program.h"
#include "bench/record.h"
#include "core/base/median.h"
#include "core/image/region.h"
#include "core/registration/object/pose_space.h"
#include "core/tracking/company.h"
#include "core/tracking/depth_gap.h"
#include "raylign/backends.h"
#include "raylign/io/frames.h"
#include "raylign/io/pose.h"
#include "raylign/io/views.h"
#include "raylign/io/volume.h"
#include "raylign/targets.h"
#include "raylign/tracking.h"

namespace raylign::detail::bench {
namespace {

ViewsFile views_of(const GaitSettings& settings) {
    ViewsReadOptions reading;
    reading.images = ReadImages::frames;
    reading.frames = {"cam1=" + settings.folder + "/cam1", "cam2=" + settings.folder + "/cam2"};
    return read_views(std::vector<std::string>{settings.folder + "/views.json"}, reading);
}

/// A bone of the sequence, and what came of it.
struct Followed {
    Followed(const GaitSettings& settings, std::size_t index) : which(index), name(kBones[index]) {
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

TrackOptions options_of(const GaitSettings& settings) {
    TrackOptions options;
    options.quick = !settings.is_thorough;
    return options;
}

std::string title(const GaitSettings& settings, const std::string& bone) {
    return bone + (settings.is_together ? ", together" : "") + (settings.is_thorough ? ", every frame in full" : "");
}

/// One bone followed through the sequence.
void follow_bone(const GaitSettings& settings, std::size_t which, Record& record) {
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
        bone.tally.take(found, gait_pose(frames.number, which, bone.centre_mm, settings.is_joined), bone.targets);
    }
    bone.tally.tell(title(settings, bone.name), record);
}

/// Both, as `raylign track` does; what they have in common counts half for each.
void follow_both(const GaitSettings& settings, Record& record) {
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
            const TrackFrame found = trackers[b].feed(frames.number, [&](std::optional<int> coarser_by) {
                return company.remainder(instant.views, b, coarser_by);
            });
            prospects[b].remember(found);
            bones[b].tally.read_s.push_back(read_s);
            bones[b].tally.seconds.push_back(processor_s() - between + shared_s / static_cast<double>(bones.size()));
            bones[b].tally.take(found, gait_pose(frames.number, b, bones[b].centre_mm, settings.is_joined),
                                bones[b].targets);
        }
    }
    for (const Followed& bone : bones) bone.tally.tell(title(settings, bone.name), record);
}

/// [frame][bone]
using FramesOfBones = std::vector<std::array<TrackFrame, kBones.size()>>;

/// Both bones in the first view alone, as `raylign track` follows them.
FramesOfBones follow_in_one_view(const GaitSettings& settings, std::deque<Followed>& bones, ViewGeometry& view) {
    const auto backend = create_backend("cpu").backend;
    std::deque<Tracker> trackers;
    std::vector<const Volume*> volumes;
    for (std::size_t b = 0; b < kBones.size(); ++b) {
        const Followed& bone = bones.emplace_back(settings, b);
        volumes.push_back(&bone.window);
        trackers.emplace_back(bone.window, bone.start, options_of(settings), *backend);
    }
    Company company(volumes, options_of(settings), *backend);
    std::array<Prospect, kBones.size()> prospects;
    FramesOfBones all;
    const ViewsFile views = views_of(settings);
    InstantReader reader(views);
    for (const FrameSet& frames : pair_frames(views, {1, settings.frames, 1})) {
        const Instant instant = reader.read(frames);
        const std::span<const View> first = std::span(instant.views).first(1);
        view = first.front().geometry;
        std::vector<Expectation> expected;
        for (std::size_t b = 0; b < kBones.size(); ++b) {
            expected.push_back({prospects[b].whereabouts(), trackers[b].predicted(frames.number)});
        }
        if (settings.is_together) company.meet(first, expected, {});
        auto& found = all.emplace_back();
        for (std::size_t b = 0; b < kBones.size(); ++b) {
            found[b] = trackers[b].feed(
                frames.number, [&](std::optional<int> coarser_by) { return company.remainder(first, b, coarser_by); });
            prospects[b].remember(found[b]);
        }
    }
    return all;
}

/// As `raylign track --joint-gap` does after tracking.
void hold_gap(double gap_mm, const std::deque<Followed>& bones, const ViewGeometry& view, FramesOfBones& all) {
    std::vector<DepthsOfFrame> depths;
    for (const auto& frame : all) {
        DepthsOfFrame& of_frame = depths.emplace_back();
        for (std::size_t b = 0; b < bones.size(); ++b) of_frame.push_back(depth_of(frame[b], bones[b].centre_mm, view));
    }
    const std::pair<std::size_t, std::size_t> pair{0, 1};
    const std::vector<DepthsOfFrame> held = hold_gaps(depths, {&pair, 1}, gap_mm);
    for (std::size_t i = 0; i < all.size(); ++i) {
        for (std::size_t b = 0; b < bones.size(); ++b) {
            if (held[i][b]) move_to(all[i][b], *held[i][b], bones[b].centre_mm, view);
        }
    }
}

/// Root mean square about the mean.
double scatter_of(const std::vector<double>& values) {
    const Eigen::Map<const Eigen::ArrayXd> all(values.data(), std::ssize(values));
    return values.empty() ? 0 : std::sqrt((all - all.mean()).square().mean());
}

/// One bone in one view: errors of its centre along the line of sight and across it, of the frames that are ok.
void tell_depth(const std::string& name, const GaitSettings& settings, const FramesOfBones& all, const Followed& bone,
                const ViewGeometry& view, Record& record) {
    std::vector<double> depth_mm, size_mm, plane_mm, expected_mm;
    int within = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
        const TrackFrame& found = all[i][bone.which];
        if (found.status != TrackStatus::ok) continue;
        const int number = found.frame;
        const Eigen::Vector3d true_mm =
            gait_pose(number, bone.which, bone.centre_mm, settings.is_joined) * bone.centre_mm;
        const Eigen::Vector3d off_mm = found.world_from_ct * bone.centre_mm - true_mm;
        const double along_mm = off_mm.dot((true_mm - source_world_mm(view)).normalized());
        depth_mm.push_back(along_mm);
        size_mm.push_back(std::abs(along_mm));
        plane_mm.push_back(std::sqrt(std::max(0.0, off_mm.squaredNorm() - along_mm * along_mm)));
        expected_mm.push_back(found.expected_in_depth_mm);
        within += std::abs(along_mm) <= 2 * found.expected_in_depth_mm;
    }
    std::cout << name << ": " << depth_mm.size() << " of " << all.size() << " frames ok, in depth off by "
              << median(size_mm) << " mm (median; with its sign " << median(depth_mm) << ", most " << most(size_mm)
              << "), from frame to frame " << scatter_of(depth_mm) << " mm (rms), expected " << median(expected_mm)
              << " mm, within twice that " << within << "; in plane " << median(plane_mm) << " mm" << std::endl;
    record.add({name, static_cast<double>(all.size()), static_cast<double>(depth_mm.size()), median(size_mm),
                most(size_mm), median(depth_mm), scatter_of(depth_mm), median(expected_mm), within, median(plane_mm)});
}

void follow_with_gap(const GaitSettings& settings, Record& record) {
    std::deque<Followed> bones;
    ViewGeometry view;
    FramesOfBones all = follow_in_one_view(settings, bones, view);
    for (const Followed& bone : bones) tell_depth(title(settings, bone.name), settings, all, bone, view, record);
    hold_gap(settings.gap_mm, bones, view, all);
    const std::string told = ", gap held to " + number_json(settings.gap_mm) + " mm";
    for (const Followed& bone : bones) tell_depth(title(settings, bone.name) + told, settings, all, bone, view, record);
}

int run(int argc, char** argv) {
    const bool tells_depth =
        std::any_of(argv, argv + argc, [](const std::string& word) { return word == "--joint-gap"; });
    Record record(argc, argv, tells_depth ? "A simulated sequence in one plane" : "A simulated gait sequence",
                  tells_depth ? depth_columns() : gait_columns());
    GaitSettings settings;
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
    tracking.add_option("--joint-gap", settings.gap_mm)->check(CLI::PositiveNumber);
    for (CLI::App* each : {&maker, &tracking}) each->add_flag("--joined", settings.is_joined);
    app.require_subcommand(1);
    CLI11_PARSE(app, argc, argv);
    if (maker.parsed()) {
        make_gait(settings);
        return 0;
    }
    if (settings.gap_mm > 0) {
        follow_with_gap(settings, record);
        record.write();
        return 0;
    }
    if (settings.is_together) follow_both(settings, record);
    for (std::size_t bone = 0; bone < kBones.size() && !settings.is_together; ++bone) {
        follow_bone(settings, bone, record);
    }
    record.write();
    return 0;
}

}  // namespace
}  // namespace raylign::detail::bench

int main(int argc, char** argv) {
    using namespace raylign::detail::bench;
    return run_program("raylign_gait", [&] { return run(argc, argv); });
}

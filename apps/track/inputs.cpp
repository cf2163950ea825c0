#include "apps/track/inputs.h"

#include <algorithm>

#include "apps/shared/append.h"
#include "apps/shared/first_guess.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/object_volume.h"
#include "apps/shared/parse.h"
#include "apps/shared/saturation.h"
#include "core/base/clock.h"
#include "core/image/region.h"
#include "core/io/files/json_node.h"
#include "core/io/poses/autoscoper_trial.h"
#include "core/registration/object/pose_space.h"

namespace raylign::detail::apps {
namespace {

/// The usual distance of neighbours: the median.
double usual_step(const std::vector<FrameSet>& frames) {
    std::vector<int> steps;
    for (std::size_t i = 1; i < frames.size(); ++i) steps.push_back(frames[i].number - frames[i - 1].number);
    if (steps.empty()) return 1;
    std::ranges::sort(steps);
    return steps[steps.size() / 2];
}

/// The line of a frame in a table of poses: its place among all frames of the first view.
int line_of(int number, const TrackInputs& inputs) {
    const auto is_before = [&](const FrameFile& frame) { return frame.number < number; };
    return 1 + static_cast<int>(std::ranges::count_if(inputs.views.origins.front().frames, is_before));
}

/// Numbers that a view lacks, for the notes: gaps are flagged, but people should hear of them before a long run.
void note_gaps(const TrackInputs& inputs, std::vector<std::string>& notes) {
    for (std::size_t v = 0; v < inputs.views.views.size(); ++v) {
        std::size_t lacking = 0;
        for (const FrameSet& set : inputs.frames) lacking += !set.files[v];
        if (lacking == 0) continue;
        notes.push_back("view " + inputs.views.views[v].name + " lacks " + std::to_string(lacking) + " of " +
                        std::to_string(inputs.frames.size()) + " frames: gaps in the trajectory");
    }
}

/// What surrounds the object would only widen the windows that it is looked for in. A layer of nothing stays, where
/// there is one: a flat side must not pass for one that is cut.
void cut_to_object(Volume& volume) {
    VoxelBox box = box_of_object(volume);
    box.begin = (box.begin.array() - 1).max(0);
    box.end = (box.end.array() + 1).min(volume.grid.size.array());
    if (box.end - box.begin != volume.grid.size) volume = crop(volume, box);
}

TrackObject read_object(const ObjectFlags& flags, TrackInputs& inputs) {
    TrackObject object{.name = flags.name};
    const auto at_frame = [&](int number, const VoxelGrid& grid) {
        return StartFrame{number, line_of(number, inputs), flags.name, grid, {}};
    };
    const bool has_start = !flags.start.empty() || flags.key_frames.empty();
    const int known_frame = has_start ? inputs.frames.front().number : flags.key_frames.begin()->first;
    const std::string known_file = has_start ? flags.start : flags.key_frames.begin()->second;
    VolumeFile volume = read_object_volume(flags.volume, inputs.views.views, [&](const VoxelGrid& grid) {
        return first_guess({known_file, {}, {}}, grid, inputs.views, at_frame(known_frame, grid)).world_from_ct;
    });
    object.volume = std::move(volume.volume);
    inputs.has_metal = inputs.has_metal || is_metal(flags.volume.file, object.volume);
    object.file_grid = volume.file_grid;  // for .tra: as Autoscoper shows the volume
    object.volume.grid = detail::flipped_grid(object.volume.grid, volume.file_grid, flags.flips);
    append_new(inputs.files, volume.files);
    for (std::string& note : volume.notes) note = flags.name + ": " + note;
    append_new(inputs.notes, volume.notes);
    const auto take_key = [&](int number, const std::string& file, bool is_correction) {
        StartFrame frame = at_frame(number, volume.file_grid);
        frame.ct = volume.files.front();
        FirstGuess guess = first_guess({file, {}, {}}, object.volume.grid, inputs.views, frame);
        object.keys[number] = {guess.world_from_ct, is_correction};
        append_new(inputs.files, guess.files);
        for (std::string& note : guess.notes) note = flags.name + ": " + note;
        append_new(inputs.notes, guess.notes);
    };
    // With key frames alone the first frame is found on the way backwards.
    if (has_start) take_key(inputs.frames.front().number, flags.start, false);
    for (const auto& [number, file] : flags.key_frames) {
        if (std::ranges::find(inputs.frames, number, &FrameSet::number) == inputs.frames.end()) {
            throw bad_value("frame of --keyframe", std::to_string(number), "one of those that are tracked");
        }
        take_key(number, file, true);
    }
    cut_to_object(object.volume);
    if (flags.axes.empty()) {
        object.ct_from_axes = RigidTransform::translate(object_extent(object.volume).centre_ct_mm);
    } else {
        object.ct_from_axes = read_axes(flags.axes);
        append_new(inputs.files, {std::filesystem::path(flags.axes)});
    }
    return object;
}

}  // namespace

std::vector<std::string> TrackInputs::view_names() const {
    std::vector<std::string> names;
    for (const View& view : views.views) names.push_back(view.name);
    return names;
}

namespace {

void check_one_view(const char* option, double value_mm, const ViewsFile& views) {
    if (value_mm == 0 || views.views.size() < 2) return;
    throw Error(std::string(option) + " is for one view: " + std::to_string(views.views.size()) +
                " views tell depth by themselves");
}

}  // namespace

RigidTransform read_axes(const std::filesystem::path& path) {
    const nlohmann::json json = detail::read_json(path);
    const detail::JsonNode root(json, "the file", path.string());
    root.allow_keys({"raylign", "ct_from_axes"});
    detail::check_format_version(root);
    const detail::JsonNode node = root.at("ct_from_axes");
    return rigid_from_matrix(node.matrix<4, 4>(), node.where());
}

TrackInputs read_track_inputs(const TrackCommandOptions& options) {
    const auto begin = Clock::now();
    TrackInputs inputs;
    inputs.saturation = options.views.saturation;
    (void)parse_saturation(inputs.saturation);
    const std::vector<ObjectFlags> objects = objects_of(options);
    inputs.joints = joints_of(options, objects);
    check_joint_gap(options, objects.size());
    for (const ObjectFlags& object : objects) {
        if (!object.axes.empty()) (void)read_axes(object.axes);  // a typo should not wait for a large CT
    }
    inputs.views =
        read_views(options.views.files, {.images = ReadImages::frames,
                                         .auto_mask = options.views.auto_mask,
                                         .frames = options.frames,
                                         .undistorted = parse_truth(options.views.undistorted, "--undistorted")});
    append_new(inputs.files, inputs.views.files);
    append_new(inputs.notes, inputs.views.notes);
    check_one_view("--depth-change", options.depth_change_mm, inputs.views);
    check_one_view("--joint-gap", options.joint_gap_mm, inputs.views);
    inputs.frames = pair_frames(inputs.views, options.range);
    inputs.frame_step = usual_step(inputs.frames);
    check_frame_sizes(inputs.views, inputs.frames);
    note_gaps(inputs, inputs.notes);
    stop_if_interrupted();
    for (const ObjectFlags& object : objects) {
        inputs.objects.push_back(read_object(object, inputs));
        stop_if_interrupted();
    }
    inputs.load_s = seconds_since(begin);
    inputs.hashes = hash_inputs(inputs.files);
    return inputs;
}

}  // namespace raylign::detail::apps

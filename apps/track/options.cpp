#include "apps/track/options.h"

#include <algorithm>
#include <charconv>

#include "apps/shared/object_volume.h"
#include "apps/shared/options.h"
#include "apps/shared/parse.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/io/files/file_format.h"
#include "core/io/files/text.h"
#include "core/io/poses/autoscoper_trial.h"
#include "core/io/views/view_files.h"

namespace raylign::detail::apps {
namespace {

/// "3", "3,4" or "femur_left" of a map; empty for anything else. With a CT of its own (-v), what is no file is a name.
std::vector<std::string> labels_in(const std::string& text, const VolumeFlags& volume) {
    std::vector<std::string> labels;
    std::error_code ignored;
    const bool may_be_name = !volume.file.empty() && !std::filesystem::exists(text, ignored);
    for (const std::string_view part : detail::split(text, ',')) {
        int label = 0;
        const auto [end, status] = std::from_chars(part.data(), part.data() + part.size(), label);
        const bool is_number = status == std::errc{} && end == part.data() + part.size();
        if (!is_number && (!may_be_name || part.empty())) return {};
        labels.emplace_back(part);
    }
    return labels;
}

std::string names_of(const std::vector<ObjectFlags>& objects) {
    std::vector<std::string> names;
    for (const ObjectFlags& object : objects) names.push_back(object.name);
    return joined(names);
}

ObjectFlags* find(std::vector<ObjectFlags>& objects, const std::string& name) {
    const auto found = std::ranges::find(objects, name, &ObjectFlags::name);
    return found == objects.end() ? nullptr : &*found;
}

ObjectFlags object_of(const std::string& argument, const TrackCommandOptions& options) {
    const auto [name, value] = split_named(argument, "--bone");
    if (!detail::is_view_name(name)) {
        throw bad_value("name of --bone", name, "letters, digits, '_', '-' or '.' (it becomes part of file names)");
    }
    ObjectFlags object{name, options.volume, "", {}, "", {}};
    const std::vector<std::string> labels = labels_in(value, options.volume);
    if (!object.volume.labels.empty() && !labels.empty()) {
        if (object.volume.file.empty()) throw Error("--bone " + argument + ": its CT is missing: give -v FILE");
        object.volume.label = labels;
        return object;
    }
    if (!object.volume.file.empty()) {
        throw Error("--bone " + argument + " contradicts -v: give a label of --labels, or leave -v out");
    }
    object.volume.file = value;
    object.volume.materials = {material_of(options.volume.materials, name)};
    if (object.volume.materials.front().empty()) object.volume.materials.clear();
    return object;
}

/// A file's name as an object's: what cannot stand in names of files becomes '_'.
std::string object_name(const std::filesystem::path& file) {
    std::string name = file.stem().string().substr(0, 64);
    for (char& c : name) {
        if (!detail::is_view_name(std::string("x") + c)) c = '_';
    }
    return detail::is_view_name(name) ? name : "object";
}

/// The volumes of the Autoscoper trials among the views; none where there is no trial.
std::vector<ObjectFlags> trial_objects(const TrackCommandOptions& options) {
    std::vector<ObjectFlags> objects;
    for (const std::string& argument : options.views.files) {
        std::error_code ignored;
        if (!std::filesystem::is_regular_file(argument, ignored) || !detail::is_autoscoper_trial(argument)) continue;
        for (const detail::TrialVolume& volume : detail::read_autoscoper_trial(argument).volumes) {
            if (detail::format_of(volume.file) != detail::FileFormat::tiff) {
                throw bad_value("VolumeFile of " + argument, volume.file.string(),
                                "a multi-page TIFF, as Autoscoper reads it; name others by --bone NAME=FILE");
            }
            ObjectFlags object{object_name(volume.file), options.volume, "", {}, "", volume.flips};
            object.volume.file = volume.file;
            const Eigen::Vector3d& size = volume.voxel_mm;
            object.volume.spacing = detail::number_text(size.x()) + "," + detail::number_text(size.y()) + "," +
                                    detail::number_text(size.z());
            const bool is_flipped = volume.flips != std::array<bool, 3>{};
            if (is_flipped && !(object.volume.object.empty() && object.volume.labels.empty())) {
                throw Error("--object and --labels are in the coordinates of a volume as stored, and " + argument +
                            " flips " + volume.file.string() + ": cut the object out of the file");
            }
            if (find(objects, object.name) != nullptr) {
                throw bad_value("volume of " + argument, object.name, "called differently than the others");
            }
            objects.push_back(std::move(object));
        }
    }
    return objects;
}

void take_starts(const TrackCommandOptions& options, std::vector<ObjectFlags>& objects) {
    std::string for_all;
    for (const std::string& argument : options.starts) {
        const std::size_t equals = argument.find('=');
        ObjectFlags* object = equals == std::string::npos ? nullptr : find(objects, argument.substr(0, equals));
        std::error_code ignored;
        if (equals == std::string::npos || (object == nullptr && std::filesystem::exists(argument, ignored))) {
            if (!for_all.empty()) throw Error("--start is given twice for all objects: name them as NAME=FILE");
            for_all = argument;
            continue;
        }
        if (object == nullptr) {
            throw bad_value("object of --start", argument.substr(0, equals), "one of " + names_of(objects));
        }
        if (!object->start.empty()) throw Error("--start names " + object->name + " twice");
        object->start = split_named(argument, "--start").second;
    }
    for (ObjectFlags& object : objects) {
        if (object.start.empty()) object.start = for_all;
    }
}

/// "120=pose.json", or "femur:120=pose.json" where there are several objects.
void take_key_frame(const std::string& argument, std::vector<ObjectFlags>& objects) {
    const auto [place, file] = split_named(argument, "--keyframe", "[NAME:]N=FILE");
    const std::size_t colon = place.find(':');
    const bool is_named = colon != std::string::npos;
    if (!is_named && objects.size() > 1) {
        throw bad_value("--keyframe", argument, "NAME:N=FILE, with one of " + names_of(objects));
    }
    ObjectFlags* object = is_named ? find(objects, place.substr(0, colon)) : &objects.front();
    if (object == nullptr) {
        throw bad_value("object of --keyframe", place.substr(0, colon), "one of " + names_of(objects));
    }
    const std::string digits = is_named ? place.substr(colon + 1) : place;
    int number = 0;
    const auto [end, status] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    if (status != std::errc{} || end != digits.data() + digits.size()) {
        throw bad_value("frame of --keyframe", digits, "a whole number");
    }
    if (!object->key_frames.emplace(number, file).second) {
        throw Error("--keyframe names frame " + digits + " of " + object->name + " twice");
    }
}

}  // namespace

std::vector<ObjectFlags> objects_of(const TrackCommandOptions& options) {
    std::vector<ObjectFlags> objects;
    if (options.bones.empty() && options.volume.file.empty()) objects = trial_objects(options);
    if (options.bones.empty() && objects.empty()) {
        if (options.volume.file.empty()) throw Error("no CT: give -v FILE, or --bone NAME=FILE");
        objects.push_back({"object", options.volume, "", {}, "", {}});
    } else if (!options.bones.empty() && !options.volume.label.empty()) {
        throw Error("--label contradicts --bone: name the labels as --bone NAME=LABEL");
    }
    for (const std::string& argument : options.bones) {
        ObjectFlags object = object_of(argument, options);
        for (const ObjectFlags& other : objects) {
            if (detail::lower_case(other.name) == detail::lower_case(object.name)) {
                throw Error("--bone names " + object.name + " twice");
            }
        }
        objects.push_back(std::move(object));
    }
    take_starts(options, objects);
    for (const std::string& argument : options.key_frames) take_key_frame(argument, objects);
    for (const std::string& argument : options.axes) {
        const auto [name, file] = split_named(argument, "--axes");
        ObjectFlags* object = find(objects, name);
        if (object == nullptr) throw bad_value("object of --axes", name, "one of " + names_of(objects));
        object->axes = file;
    }
    return objects;
}

void check_joint_gap(const TrackCommandOptions& options, std::size_t object_count) {
    if (options.joint_gap_mm == 0) return;
    if (!(options.joint_gap_mm > 0 && options.joint_gap_mm <= 1000)) {
        throw bad_value("--joint-gap", detail::number_text(options.joint_gap_mm) + " mm", "in (0, 1000] mm");
    }
    if (object_count > 1) return;
    throw Error("--joint-gap holds the depths of several objects together, and there is one: name more by --bone");
}

std::vector<std::pair<std::size_t, std::size_t>> joints_of(const TrackCommandOptions& options,
                                                           const std::vector<ObjectFlags>& objects) {
    std::vector<std::pair<std::size_t, std::size_t>> joints;
    (void)CardanSequence::from_name(options.cardan);
    for (const std::string& argument : options.joints) {
        const auto parts = detail::split(argument, ',');
        if (parts.size() != 2) throw bad_value("--joint", argument, "PROXIMAL,DISTAL");
        std::vector<std::size_t> ends;
        for (const std::string_view part : parts) {
            const auto found = std::ranges::find(objects, part, &ObjectFlags::name);
            if (found == objects.end()) throw bad_value("object of --joint", part, "one of " + names_of(objects));
            ends.push_back(static_cast<std::size_t>(found - objects.begin()));
        }
        if (ends[0] == ends[1]) throw bad_value("--joint", argument, "two different objects");
        const std::pair joint(ends[0], ends[1]);
        if (std::ranges::find(joints, joint) != joints.end()) throw Error("--joint " + argument + " is given twice");
        joints.push_back(joint);
    }
    if (joints.empty() && !options.axes.empty()) throw Error("--axes has no meaning without --joint");
    return joints;
}

TrackOptions track_options(const TrackCommandOptions& options, double frame_step) {
    TrackOptions track;
    track.registration = registration_options(options.method, options.search, options.backend);
    track.recovery = search_from_name(options.recover);
    if (track.recovery == Search::automatic) throw bad_value("--recover", "auto", "none, near or global");
    if (options.max_jump_mm != 0) track.max_jump_mm = options.max_jump_mm;
    if (options.depth_change_mm != 0) track.depth_change_mm = options.depth_change_mm;
    track.frame_step = frame_step;
    track.quick = !options.is_thorough;
    if (const std::string fault = track.problem(); !fault.empty()) throw Error(fault);
    return track;
}

}  // namespace raylign::detail::apps

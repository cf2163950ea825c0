#include "apps/register/scene_inputs.h"

#include <algorithm>
#include <map>

#include "apps/shared/append.h"
#include "apps/shared/clock.h"
#include "apps/shared/first_guess.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/object_volume.h"
#include "apps/shared/options.h"
#include "apps/shared/parse.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/image/region.h"
#include "core/io/files/text.h"
#include "core/io/views/view_files.h"
#include "core/io/volumes/labelled_objects.h"
#include "core/registration/object/overlap.h"
#include "raylign/intensity.h"
#include "raylign/io/pose.h"
#include "raylign/io/views.h"
#include "raylign/joint_motion.h"
#include "raylign/targets.h"

namespace raylign::detail::apps {
namespace {

constexpr const char* kAllBones = "all-bones";
constexpr const char* kRestName = "rest";
constexpr double kShown = 0.5;  // share of a bone that a view must show for all-bones to take it

/// "1,2,3,4,5,6" or "voxels:...": what --object means with one object.
bool is_box(const std::string& text) { return text.starts_with("voxels:") || text.find(',') != std::string::npos; }

/// Files by name of the object, and one for all others.
struct NamedFiles {
    std::string for_all;
    std::map<std::string, std::string> of;

    [[nodiscard]] std::string file(const std::string& name) const {
        const auto found = of.find(name);
        return found == of.end() ? for_all : found->second;
    }
};

NamedFiles named_files(const std::vector<std::string>& arguments, const std::string& option,
                       const std::vector<std::string>& names) {
    NamedFiles files;
    for (const std::string& argument : arguments) {
        const std::size_t equals = argument.find('=');
        const bool is_known =
            equals != std::string::npos && std::ranges::find(names, argument.substr(0, equals)) != names.end();
        std::error_code ignored;
        if (!is_known && (equals == std::string::npos || std::filesystem::exists(argument, ignored))) {
            if (!files.for_all.empty()) throw Error(option + " is given twice for all objects: name them as NAME=FILE");
            files.for_all = argument;
            continue;
        }
        const auto [name, file] = split_named(argument, option);
        if (!is_known) throw bad_value("object of " + option, name, "one of " + joined(names));
        if (!files.of.emplace(name, file).second) throw Error(option + " names " + name + " twice");
    }
    return files;
}

/// What --object and --bone ask for.
struct Asked {
    std::vector<LabelledName> labelled;
    bool all_bones = false;
    std::vector<std::pair<std::string, std::string>> files;  ///< name, file
};

void check_name(const std::string& name, const std::string& option) {
    if (is_view_name(name) && lower_case(name) != kRestName) return;
    throw bad_value("name of " + option, name,
                    "letters, digits, '_', '-' or '.' (it becomes part of file names), and not \"rest\"");
}

Asked asked_objects(const RegisterOptions& options) {
    Asked asked;
    for (const std::string& object : options.scene.objects) {
        if (is_box(object)) continue;
        if (object == kAllBones) {
            asked.all_bones = true;
            continue;
        }
        check_name(object, "--object");
        asked.labelled.push_back({number_from(object) ? "label_" + object : object, {object}});
    }
    for (const std::string& argument : options.scene.bones) {
        const auto [name, value] = split_named(argument, "--bone", "NAME=FILE or NAME=LABELS");
        check_name(name, "--bone");
        std::error_code ignored;
        if (options.volume.file.empty() || std::filesystem::exists(value, ignored)) {
            asked.files.emplace_back(name, value);
        } else {
            asked.labelled.push_back({name, parse_list(value, "--bone")});
        }
    }
    return asked;
}

void check_asked(const Asked& asked, const RegisterOptions& options) {
    const bool by_label = asked.all_bones || !asked.labelled.empty();
    if (asked.all_bones && !asked.labelled.empty()) throw Error("--object all-bones contradicts other objects");
    if (by_label && !asked.files.empty()) throw Error("--bone NAME=FILE contradicts objects by label: give one kind");
    if (by_label && options.volume.file.empty()) throw Error("objects by label: their CT is missing: give -v FILE");
    if (by_label && options.volume.labels.empty()) throw Error("objects by label: give the map, --labels FILE");
    if (!by_label && !options.volume.file.empty()) throw Error("--bone NAME=FILE contradicts -v: leave -v out");
    if (!by_label && !options.scene.rest.empty() && options.scene.rest != "none") {
        throw Error("--rest is for objects by label: files of bones have no rest");
    }
    if (!options.volume.label.empty()) throw Error("--label contradicts --object and --bone: they name the labels");
    const std::string& rest = options.scene.rest;
    if (!rest.empty() && rest != "body" && rest != "still" && rest != "none") {
        throw bad_value("--rest", rest, "body, still or none");
    }
    for (std::size_t a = 0; a < asked.files.size(); ++a) {
        for (std::size_t b = 0; b < a; ++b) {
            if (lower_case(asked.files[a].first) == lower_case(asked.files[b].first)) {
                throw Error("--bone names " + asked.files[a].first + " twice");
            }
        }
    }
}

/// HU above which voxels of an object count: as asked for, or with a rest what water does not explain.
std::optional<float> counted_above(const RegisterOptions& options, bool has_rest) {
    if (!options.volume.bone_threshold && !has_rest) return std::nullopt;
    const double level = options.volume.bone_threshold.value_or(0);
    if (options.volume.attenuation && options.volume.bone_threshold) return static_cast<float>(level);
    const std::string& preset = options.volume.hu_preset;
    return attenuation_from_hu(level,
                               preset.empty() || options.volume.attenuation ? hu_presets().front() : hu_preset(preset));
}

void read_labelled(const RegisterOptions& options, const Asked& asked, const ViewsFile& views, SceneInputs& inputs) {
    VolumeFlags whole = options.volume;
    whole.labels = whole.label_table = "";
    whole.bone_threshold.reset();
    VolumeFile ct = read_volume(whole.file, volume_read_options(whole));
    append(inputs.files, ct.files);
    append(inputs.notes, ct.notes);
    const bool has_rest = options.scene.rest == "body" || options.scene.rest == "still";
    LabelledObjects cut = cut_objects(ct.volume, {options.volume.labels, options.volume.label_table, asked.labelled,
                                                  counted_above(options, has_rest), has_rest});
    append(inputs.files, cut.files);
    append(inputs.notes, cut.notes);
    const NamedFiles starts = named_files(options.scene.starts, "--start", cut.names);
    const StartFrame frame{0, 0, "", ct.file_grid, ct.files.front()};
    const auto start_of = [&](const std::string& file) {
        FirstGuess guess =
            first_guess({file, options.start.landmarks3d, options.start.landmarks}, ct.volume.grid, views, frame);
        append_new(inputs.files, guess.files);
        append_new(inputs.notes, guess.notes);
        return guess.world_from_ct;
    };
    for (std::size_t k = 0; k < cut.names.size(); ++k) {
        inputs.objects.push_back(
            {cut.names[k], std::move(cut.objects[k]), start_of(starts.file(cut.names[k])), Mobility::moves});
    }
    if (!cut.rest) return;
    const bool is_common = !starts.for_all.empty() || starts.of.empty();
    inputs.objects.push_back({kRestName, std::move(*cut.rest),
                              is_common ? start_of(starts.for_all) : inputs.objects.front().start_world_from_ct,
                              options.scene.rest == "body" ? Mobility::moves : Mobility::stays, true});
}

void refuse_same_bone(const SceneInputs& inputs) {
    for (std::size_t a = 0; a < inputs.objects.size(); ++a) {
        for (std::size_t b = 0; b < a; ++b) {
            const Volume &one = inputs.objects[a].volume, &other = inputs.objects[b].volume;
            if (one.attenuation_per_mm != other.attenuation_per_mm) continue;
            throw Error("--bone: " + inputs.objects[b].name + " and " + inputs.objects[a].name +
                        " hold the same bone, voxel by voxel");
        }
    }
}

void read_bone_files(const RegisterOptions& options, const Asked& asked, const ViewsFile& views, SceneInputs& inputs) {
    std::vector<std::string> names;
    for (const auto& bone : asked.files) names.push_back(bone.first);
    const NamedFiles starts = named_files(options.scene.starts, "--start", names);
    for (const auto& bone : asked.files) {
        VolumeFlags flags = options.volume;
        flags.file = bone.second;
        flags.materials = {};
        const std::string material = material_of(options.volume.materials, bone.first);
        if (!material.empty()) flags.materials.push_back(material);
        const StartFlags start{starts.file(bone.first), options.start.landmarks3d, options.start.landmarks};
        VolumeFile file = read_object_volume(flags, views.views, [&](const VoxelGrid& grid) {
            return first_guess(start, grid, views, {0, 0, bone.first, grid, flags.file}).world_from_ct;
        });
        append_new(inputs.files, file.files);
        for (const std::string& note : file.notes) inputs.notes.push_back(bone.first + ": " + note);
        FirstGuess guess =
            first_guess(start, file.volume.grid, views, {0, 0, bone.first, file.file_grid, file.files.front()});
        append_new(inputs.files, guess.files);
        for (const std::string& note : guess.notes) inputs.notes.push_back(bone.first + ": " + note);
        inputs.objects.push_back({bone.first, std::move(file.volume), guess.world_from_ct, Mobility::moves});
    }
    refuse_same_bone(inputs);
}

/// Of all bones of a map those that a view shows where the start puts them.
void keep_shown(SceneInputs& inputs) {
    std::vector<std::string> left_out;
    std::erase_if(inputs.objects, [&](const SceneInput& object) {
        if (object.is_rest) return false;
        const ObjectSample sample = sample_object(object.volume);
        const bool is_shown = std::ranges::any_of(inputs.views, [&](const View& view) {
            return seen_share(sample, view, object.start_world_from_ct) >= kShown;
        });
        if (!is_shown) left_out.push_back(object.name);
        return !is_shown;
    });
    if (!left_out.empty())
        inputs.notes.push_back("left out, since no view shows them at the start: " + joined(left_out));
    if (std::ranges::all_of(inputs.objects, &SceneInput::is_rest)) {
        throw Error("--object all-bones: no view shows any of them at the start");
    }
}

void read_truths(const RegisterOptions& options, SceneInputs& inputs) {
    std::vector<std::string> names;
    for (const SceneInput& object : inputs.objects) names.push_back(object.name);
    const NamedFiles truths = named_files(options.scene.truths, "--truth", names);
    for (SceneInput& object : inputs.objects) {
        const std::string file = truths.file(object.name);
        if (file.empty() || object.is_rest) continue;
        object.true_world_from_ct = read_pose(file);
        object.targets_ct_mm = default_targets_ct_mm(object.volume);
        append_new(inputs.files, {std::filesystem::path(file)});
    }
}

void read_joints(const SceneFlags& flags, SceneInputs& inputs) {
    if (!flags.cardan.empty() && flags.joints.empty()) throw Error("--cardan has no meaning without --joint");
    std::vector<std::string> names;
    for (const SceneInput& object : inputs.objects) names.push_back(object.name);
    for (const std::string& argument : flags.joints) {
        const std::vector<std::string> ends = parse_list(argument, "--joint");
        if (ends.size() != 2) throw bad_value("--joint", argument, "PROXIMAL,DISTAL");
        std::vector<std::size_t> at;
        for (const std::string& end : ends) {
            const auto found = std::ranges::find(names, end);
            if (found == names.end()) throw bad_value("object of --joint", end, "one of " + joined(names));
            at.push_back(static_cast<std::size_t>(found - names.begin()));
        }
        inputs.joints.emplace_back(at[0], at[1]);
    }
}

}  // namespace

bool is_scene(const RegisterOptions& options) {
    return !options.scene.bones.empty() ||
           std::ranges::any_of(options.scene.objects, [](const std::string& object) { return !is_box(object); });
}

void settle_one_object(RegisterOptions& options) {
    const SceneFlags& scene = options.scene;
    if (options.volume.file.empty()) throw Error("no CT: give -v FILE, or --bone NAME=FILE");
    if (!scene.rest.empty()) throw Error("--rest is for several objects: name them by --object");
    if (!scene.joints.empty() || !scene.cardan.empty()) {
        throw Error("--joint and --cardan are for several objects: name them by --object or --bone");
    }
    if (scene.starts.size() > 1) throw Error("--start is given twice: one object has one start");
    if (scene.truths.size() > 1) throw Error("--truth is given twice: one object has one true pose");
    if (scene.objects.size() > 1) throw Error("--object is given twice: one object has one box");
    if (!scene.starts.empty()) options.start.pose = scene.starts.front();
    if (!scene.truths.empty()) options.truth.truth = scene.truths.front();
    if (!scene.objects.empty()) options.volume.object = scene.objects.front();
}

SceneInputs read_scene_inputs(const RegisterOptions& options) {
    const auto begin = Clock::now();
    if (!options.truth.targets.empty()) throw Error("--targets is for one object: leave it out with several");
    const Asked asked = asked_objects(options);
    check_asked(asked, options);
    if (!options.scene.cardan.empty()) (void)CardanSequence::from_name(options.scene.cardan);
    settle_conflicts(options.start);
    SceneInputs inputs;
    ViewsFile views =
        read_views(options.views.files, {.images = ReadImages::required,
                                         .auto_mask = options.views.auto_mask,
                                         .undistorted = parse_truth(options.views.undistorted, "--undistorted")});
    append(inputs.files, views.files);
    append(inputs.notes, views.notes);
    if (asked.files.empty()) {
        read_labelled(options, asked, views, inputs);
    } else {
        read_bone_files(options, asked, views, inputs);
    }
    stop_if_interrupted();
    inputs.views = std::move(views.views);
    if (asked.all_bones) keep_shown(inputs);
    read_truths(options, inputs);
    read_joints(options.scene, inputs);
    inputs.load_s = seconds_since(begin);
    inputs.hashes = hash_inputs(inputs.files);
    return inputs;
}

}  // namespace raylign::detail::apps

#include "apps/objects/scene_inputs.h"

#include <algorithm>

#include "apps/shared/append.h"
#include "apps/shared/first_guess.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/object_volume.h"
#include "apps/shared/options.h"
#include "apps/shared/parse.h"
#include "core/base/clock.h"
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

constexpr double kBone_hu = 200;  // what --segment-bones takes for bone
constexpr double kShown = 0.5;    // share of a bone that a view must show for all-bones to take it

/// HU above which voxels of an object count: as asked for, or with a rest what water does not explain.
std::optional<float> counted_above(const ObjectOptions& options, bool has_rest) {
    if (!options.volume.bone_threshold && !has_rest) return std::nullopt;
    const double level = options.volume.bone_threshold.value_or(0);
    if (options.volume.attenuation && options.volume.bone_threshold) return static_cast<float>(level);
    const std::string& preset = options.volume.hu_preset;
    return attenuation_from_hu(level,
                               preset.empty() || options.volume.attenuation ? hu_presets().front() : hu_preset(preset));
}

/// How bone is told from the rest where there is no map.
std::optional<BoneSplitOptions> split_of(const ObjectOptions& options) {
    if (!options.scene.segment_bones) return std::nullopt;
    const double level = options.volume.bone_threshold.value_or(kBone_hu);
    const std::string& preset = options.volume.hu_preset;
    const bool is_per_mm = options.volume.attenuation && options.volume.bone_threshold;
    const HuPreset& units = preset.empty() || options.volume.attenuation ? hu_presets().front() : hu_preset(preset);
    return BoneSplitOptions{is_per_mm ? static_cast<float>(level) : attenuation_from_hu(level, units)};
}

void read_labelled(const ObjectOptions& options, const Asked& asked, const ViewsFile& views, SceneInputs& inputs) {
    VolumeFlags whole = options.volume;
    whole.labels = whole.label_table = "";
    whole.bone_threshold.reset();
    VolumeFile ct = read_volume(whole.file, volume_read_options(whole));
    append(inputs.files, ct.files);
    append(inputs.notes, ct.notes);
    const bool has_rest = options.scene.rest == "body" || options.scene.rest == "still";
    LabelledObjects cut = cut_objects(ct.volume, {options.volume.labels, options.volume.label_table, asked.labelled,
                                                  counted_above(options, has_rest), has_rest, split_of(options)});
    inputs.split = std::move(cut.split);
    append(inputs.files, cut.files);
    append(inputs.notes, cut.notes);
    const NamedFiles starts = named_files(options.scene.starts, "--start", cut.names);
    const auto start_of = [&](const std::string& file, const std::string& name) {
        const StartFrame frame{0, 0, name, ct.file_grid, ct.files.front()};
        FirstGuess guess =
            first_guess({file, options.start.landmarks3d, options.start.landmarks}, ct.volume.grid, views, frame);
        append_new(inputs.files, guess.files);
        append_new(inputs.notes, guess.notes);
        return guess.world_from_ct;
    };
    for (std::size_t k = 0; k < cut.names.size(); ++k) {
        inputs.objects.push_back({cut.names[k], std::move(cut.objects[k]),
                                  start_of(starts.file(cut.names[k]), cut.names[k]), Mobility::moves});
    }
    if (!cut.rest) return;
    const bool is_common = !starts.for_all.empty() || starts.of.empty();
    inputs.objects.push_back(
        {kRestName, std::move(*cut.rest),
         is_common ? start_of(starts.for_all, kRestName) : inputs.objects.front().start_world_from_ct,
         options.scene.rest == "body" ? Mobility::moves : Mobility::stays, true});
}

/// Whatever there is of nothing around it in the files.
void refuse_same_bone(const SceneInputs& inputs) {
    std::vector<Volume> bones;
    for (const SceneInput& object : inputs.objects) bones.push_back(crop(object.volume, box_of_object(object.volume)));
    for (std::size_t a = 0; a < bones.size(); ++a) {
        for (std::size_t b = 0; b < a; ++b) {
            if (bones[a].grid.size != bones[b].grid.size) continue;
            if (bones[a].attenuation_per_mm != bones[b].attenuation_per_mm) continue;
            throw Error("--bone: " + inputs.objects[b].name + " and " + inputs.objects[a].name +
                        " hold the same bone, voxel by voxel");
        }
    }
}

void read_bone_files(const ObjectOptions& options, const Asked& asked, const ViewsFile& views, SceneInputs& inputs) {
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

void read_truths(const ObjectOptions& options, SceneInputs& inputs) {
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
    inputs.joints = asked_joints(flags.joints, names);
    for (const AskedJoint& joint : inputs.joints) {
        if (!(joint.apart_mm > 0)) continue;
        inputs.limits.push_back({joint.proximal, joint.distal, joint.apart_mm, joint.turned_deg});
    }
}

}  // namespace

bool is_scene(const ObjectOptions& options) {
    return !options.scene.bones.empty() ||
           std::ranges::any_of(options.scene.objects, [](const std::string& object) { return !is_box(object); });
}

void settle_one_object(ObjectOptions& options) {
    const SceneFlags& scene = options.scene;
    if (options.volume.file.empty()) throw Error("no CT: give -v FILE, or --bone NAME=FILE");
    if (!scene.rest.empty()) throw Error("--rest is for several objects: name them by --object");
    if (scene.segment_bones) throw Error("--segment-bones is for several objects: name them by --object");
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

SceneInputs read_scene_inputs(const ObjectOptions& options, ReadImages images) {
    const auto begin = Clock::now();
    if (!options.truth.targets.empty()) throw Error("--targets is for one object: leave it out with several");
    const Asked asked = asked_objects(options);
    if (!options.scene.cardan.empty()) (void)CardanSequence::from_name(options.scene.cardan);
    settle_conflicts(options.start);
    SceneInputs inputs;
    ViewsFile views =
        read_views(options.views.files, {.images = images,
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
    inputs.origins = std::move(views.origins);
    if (asked.all_bones) keep_shown(inputs);
    read_truths(options, inputs);
    read_joints(options.scene, inputs);
    inputs.load_s = seconds_since(begin);
    inputs.hashes = hash_inputs(inputs.files);
    return inputs;
}

}  // namespace raylign::detail::apps

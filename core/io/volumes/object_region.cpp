#include "core/io/volumes/object_region.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/image/region.h"
#include "core/io/files/text.h"
#include "core/io/volumes/label_map.h"
#include "raylign/intensity.h"

namespace raylign::detail {
namespace {

constexpr double kFade_mm = 4;  // wider than the finest filter: the cut makes no edge

std::string voxels_text(const Eigen::Vector3i& size) {
    return std::to_string(size.x()) + " x " + std::to_string(size.y()) + " x " + std::to_string(size.z());
}

/// The attenuation of a value that the person gives in the voxels' unit.
float attenuation_of(double value, const VolumeReadOptions& options, const char* what) {
    if (!std::isfinite(value)) throw bad_value(what, number_text(value), "finite");
    if (options.is_attenuation) {
        if (!(value > 0)) throw bad_value(what, number_text(value) + " / mm", "positive (the voxels are in 1/mm)");
        if (value > 10)
            throw bad_value(what, number_text(value) + " / mm", "at most 10: is it in HU? The voxels are in 1/mm");
        return static_cast<float>(value);
    }
    const HuPreset& preset = options.hu_preset.empty() ? hu_presets().front() : hu_preset(options.hu_preset);
    if (!(value > preset.cutoff_hu)) {
        throw bad_value(what, number_text(value) + " HU",
                        "above the preset's cut-off, " + number_text(preset.cutoff_hu));
    }
    return attenuation_from_hu(value, preset);
}

void check_left(const Volume& volume, const std::string& after) {
    const bool is_left = std::ranges::any_of(volume.attenuation_per_mm, [](float v) { return v != 0; });
    if (!is_left) throw Error("nothing is left of the CT after " + after + ": all voxels are 0");
}

/// Whose names of labels count, and what they are called in messages.
struct NamedLabels {
    LabelNames names;
    std::string source;
};

NamedLabels names_for(const ObjectRegion& object, const LabelMapFile& file) {
    if (!object.label_table.empty()) return {read_label_names(object.label_table), object.label_table.string()};
    if (!file.names.empty()) return {file.names, "the names in " + object.label_map.string()};
    if (object.label_names.empty()) return {};  // a map of anyone's, by number
    return {total_segmentator_names(), "TotalSegmentator's labels (task total, version 2)"};
}

/// "29 (vertebrae_L3)", or the number alone.
std::string label_text(std::int32_t label, const LabelNames& names) {
    const auto name = names.find(label);
    return std::to_string(label) + (name == names.end() ? "" : " (" + name->second + ")");
}

void keep_labelled(const ObjectRegion& object, VolumeFile& file) {
    const LabelMapFile read = read_label_map_file(object.label_map, file.volume.grid);
    const NamedLabels named = names_for(object, read);
    std::vector<std::int32_t> kept = object.labels;
    for (const std::string& name : object.label_names) kept.push_back(label_of(named.names, name, named.source));
    const std::string list = joined(
        kept, [&](std::int32_t label) { return label_text(label, named.names); }, ", ");
    if (kept.empty()) {
        const std::set<std::int32_t> all(read.map.labels.begin(), read.map.labels.end());
        std::ranges::copy_if(all, std::back_inserter(kept), [](std::int32_t label) { return label != 0; });
    }
    try {
        keep_labels(file.volume, read.map, kept);
    } catch (const Error& failure) {
        throw Error(object.label_map.string() + ": " + failure.what() +
                    (object.label_names.empty() ? "" : " (labels asked for: " + list + ")"));
    }
    for (const std::string& note : read.notes) file.notes.push_back("label map: " + note);
    file.notes.push_back("object: " + (list.empty() ? std::string("all labels") : "label " + list) + " of " +
                         object.label_map.string() + (object.label_names.empty() ? "" : ", by " + named.source));
    file.files.push_back(object.label_map);
    if (!object.label_table.empty()) file.files.push_back(object.label_table);
}

}  // namespace

void keep_object(const VolumeReadOptions& options, VolumeFile& file) {
    const ObjectRegion& object = options.object;
    const std::string unit = options.is_attenuation ? " / mm" : " HU";
    if (object.clip_hu) {
        clip_above(file.volume, attenuation_of(*object.clip_hu, options, "--clip"));
        file.notes.push_back("voxels above " + number_text(*object.clip_hu) + unit + " were lowered to it (metal)");
    }
    if (!object.label_map.empty()) {
        keep_labelled(object, file);
        check_left(file.volume, "keeping the label");
    }
    if (object.box_mm) {
        keep_inside(file.volume, *object.box_mm);
        check_left(file.volume, "keeping the box");
    }
    if (object.box_voxels) file.volume = crop(file.volume, *object.box_voxels);
    if (object.bone_threshold_hu) {
        contrast_above(file.volume, attenuation_of(*object.bone_threshold_hu, options, "--bone-threshold"));
        file.notes.push_back("voxels count by what they exceed " + number_text(*object.bone_threshold_hu) + unit +
                             " by: bone's contrast to the tissue around it");
        check_left(file.volume, "the bone threshold");
    }
    if (object.box_mm) fade_faces(file.volume, *object.box_mm, kFade_mm);
    if (object.box_voxels) fade_sides(file.volume, kFade_mm);
    if (object.box_mm || object.box_voxels) {
        file.notes.push_back("tissue fades out over " + number_text(kFade_mm) + " mm towards the faces of the box");
    }
    const Eigen::Vector3i before = file.volume.grid.size;
    file.volume = crop(file.volume, box_of_object(file.volume));
    if (file.volume.grid.size != before) {
        file.notes.push_back("cropped to what is left, " + voxels_text(file.volume.grid.size) + " of " +
                             voxels_text(before) + " voxels");
    }
}

}  // namespace raylign::detail

#include "core/io/volumes/labelled_objects.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/text.h"
#include "core/image/region.h"
#include "core/io/files/text.h"
#include "core/io/volumes/label_map.h"

namespace raylign::detail {
namespace {

/// A label map with its names.
struct NamedMap {
    LabelMap map;
    LabelNames names;
    std::string source;
};

/// The pieces that the CT's bone falls into.
NamedMap split_map(const ObjectCut& cut, const Volume& ct, LabelledObjects& found) {
    found.split = split_bones(ct, *cut.split);
    LabelNames names;
    std::string text;
    for (const SplitBone& bone : found.split->bones) {
        names.emplace(bone.label, bone.name);
        text += (text.empty() ? "" : ", ") + bone.name + " (" + fixed(bone.volume_mm3 / 1000, 0) + " cm3)";
    }
    found.notes.push_back("connected bones of the CT, a split for registration and no diagnosis: " + text);
    return {found.split->map, names, "the connected bones of the CT"};
}

NamedMap named_map(const ObjectCut& cut, const Volume& ct, LabelledObjects& found) {
    if (cut.split) return split_map(cut, ct, found);
    LabelMapFile file = read_label_map_file(cut.label_map, ct.grid);
    for (const std::string& note : file.notes) found.notes.push_back("label map: " + note);
    found.files.push_back(cut.label_map);
    if (!cut.label_table.empty()) {
        found.files.push_back(cut.label_table);
        return {std::move(file.map), read_label_names(cut.label_table), cut.label_table.string()};
    }
    if (!file.names.empty()) {
        return {std::move(file.map), file.names, "the names in " + cut.label_map.string()};
    }
    return {std::move(file.map), total_segmentator_names(), "TotalSegmentator's labels (task total, version 2)"};
}

std::int32_t number_of(const std::string& label, const NamedMap& named) {
    const std::optional<double> number = number_from(label);
    if (!number) return label_of(named.names, label, named.source);
    if (*number == std::round(*number) && std::abs(*number) < 2147483648.0) return static_cast<std::int32_t>(*number);
    throw bad_value("label", label, "a whole number of up to 32 bits, or a name");
}

/// An object and the numbers of its labels.
struct Wanted {
    std::string name;
    std::vector<std::int32_t> labels;
};

std::vector<Wanted> asked_for(const ObjectCut& cut, const NamedMap& named) {
    std::vector<Wanted> wanted;
    std::map<std::int32_t, std::string> taken;
    for (const LabelledName& object : cut.objects) {
        Wanted one{object.name, {}};
        for (const Wanted& other : wanted) {
            if (lower_case(other.name) == lower_case(one.name)) throw Error("two objects are called " + one.name);
        }
        for (const std::string& label : object.labels) {
            const std::int32_t number = number_of(label, named);
            const auto [place, is_new] = taken.emplace(number, object.name);
            if (!is_new) {
                throw Error("label " + label + " is of two objects: " + place->second + " and " + object.name);
            }
            one.labels.push_back(number);
        }
        wanted.push_back(std::move(one));
    }
    return wanted;
}

/// Every label of the map that is named as a bone; where none is, every label that has a name or not.
std::vector<Wanted> all_bones(const NamedMap& named) {
    std::set<std::int32_t> present(named.map.labels.begin(), named.map.labels.end());
    present.erase(0);
    std::vector<Wanted> bones, others;
    for (const std::int32_t label : present) {
        const auto name = named.names.find(label);
        const bool is_named = name != named.names.end();
        const bool is_bone = is_named && is_bone_name(name->second);
        (is_bone ? bones : others).push_back({is_named ? name->second : "label_" + std::to_string(label), {label}});
    }
    return bones.empty() ? others : bones;
}

std::size_t voxel_count(const Volume& volume) {
    return volume.attenuation_per_mm.size() -
           static_cast<std::size_t>(std::ranges::count(volume.attenuation_per_mm, 0.F));
}

/// The object's voxels.
Volume cut_out(const Volume& ct, const Wanted& wanted, const NamedMap& named, std::optional<float> level) {
    Volume own = ct;
    keep_labels(own, named.map, wanted.labels);
    if (level) contrast_above(own, *level);
    return own;
}

void subtract(Volume& rest, const Volume& own) {
    std::ranges::transform(rest.attenuation_per_mm, own.attenuation_per_mm, rest.attenuation_per_mm.begin(),
                           std::minus<>());
}

}  // namespace

bool is_bone_name(std::string_view name) {
    constexpr std::array<std::string_view, 20> kBones{
        "vertebra", "sacrum", "coccyx", "rib_",  "sternum", "clavic", "scapula", "humer",  "radius", "ulna",
        "carpal",   "hip_",   "pelvis", "femur", "patella", "tibia",  "fibula",  "tarsal", "skull",  "phalan"};
    const std::string lower = lower_case(name);
    return std::ranges::any_of(kBones, [&](std::string_view bone) { return lower.find(bone) != std::string::npos; });
}

LabelledObjects cut_objects(const Volume& ct, const ObjectCut& cut) {
    LabelledObjects found;
    const NamedMap named = named_map(cut, ct, found);
    const bool takes_all = cut.objects.empty();
    const std::vector<Wanted> wanted = takes_all ? all_bones(named) : asked_for(cut, named);
    if (cut.with_rest) found.rest = ct;
    const std::string source = cut.split ? named.source : cut.label_map.string();
    for (const Wanted& one : wanted) {
        const std::string of_object = " (object " + one.name + " of " + source + ")";
        try {
            const Volume own = cut_out(ct, one, named, cut.above_per_mm);
            const std::size_t voxels = voxel_count(own);
            if (voxels < kLeastVoxels) {
                throw bad_value("voxels of an object", std::to_string(voxels),
                                "at least " + std::to_string(kLeastVoxels));
            }
            found.objects.push_back(crop(own, box_of_object(own)));
            found.names.push_back(one.name);
            if (found.rest) subtract(*found.rest, own);
        } catch (const Error& error) {
            if (!takes_all) throw Error(error.what() + of_object);
            found.notes.push_back("left out: " + std::string(error.what()) + of_object);
        }
    }
    if (found.objects.empty()) throw Error(source + ": no label of it is an object in the CT");
    found.notes.push_back("objects: " + joined(found.names) + " of " + source + ", by " + named.source);
    return found;
}

}  // namespace raylign::detail

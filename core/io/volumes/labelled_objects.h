#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/image/bone_split.h"
#include "raylign/io/volume.h"

namespace raylign::detail {

/// An object by labels of a map: its name, and the numbers or names of the labels that it is made of.
struct LabelledName {
    std::string name;
    std::vector<std::string> labels;
};

/// What a CT is cut into.
struct LabelledObjects {
    std::vector<std::string> names;  ///< of the objects
    std::vector<Volume> objects;     ///< cropped to what they are
    std::optional<Volume> rest;      ///< of the body, where asked for
    std::vector<std::string> notes;
    std::vector<std::filesystem::path> files;  ///< read for it
    std::optional<BoneSplit> split;            ///< where the CT was split without a map
};

/// How a CT is cut.
struct ObjectCut {
    std::filesystem::path label_map, label_table;  ///< as in ObjectRegion
    std::vector<LabelledName> objects;             ///< none = all bones of the map: labels named as bones, else all
    std::optional<float> above_per_mm;             ///< an object is what its voxels exceed this by; none = all of them
    /// Also what is left of the body. It keeps of the objects' voxels what `above_per_mm` leaves there: where an object
    /// has moved, soft tissue has taken its place. The volumes add up to the CT.
    bool with_rest = false;
    std::optional<BoneSplitOptions> split;  ///< instead of a map: core/image/bone_split.h; its pieces are the labels
};

/// Fewest voxels of an object: less has no shape.
inline constexpr std::size_t kLeastVoxels = 27;

/// Cuts objects out of a CT by their labels, and what is left of the body. Throws Error for a label that is not in the
/// names (with the nearest one) or not in the map (with those that are), two objects with a label or a name in common,
/// an object of fewer than kLeastVoxels voxels (of all bones such are left out, and said so), and a map that says
/// nothing about the CT.
[[nodiscard]] LabelledObjects cut_objects(const Volume& ct, const ObjectCut& cut);

/// True where a label's name is a bone's, as TotalSegmentator and others name bones.
[[nodiscard]] bool is_bone_name(std::string_view name);

}  // namespace raylign::detail

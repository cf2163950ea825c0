#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/io/volumes/label_names.h"
#include "raylign/volume.h"

namespace raylign::detail {

/// A label map as its file has it, and what was decided on reading it.
struct LabelMapFile {
    LabelMap map;
    LabelNames names;  ///< where the file names its labels
    std::vector<std::string> notes;
};

/// As read_label_map (raylign/io/volume.h).
[[nodiscard]] LabelMapFile read_label_map_file(const std::filesystem::path& path, const VoxelGrid& like);

}  // namespace raylign::detail

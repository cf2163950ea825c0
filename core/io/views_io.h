#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/image/intensity.h"
#include "core/image/view.h"

namespace raylign {

enum class ReadImages {
    required,  ///< register, compare: a view without an image is an error
    if_named,  ///< study: read what is there
    never,     ///< drr: geometry only
};

struct ViewsFile {
    std::vector<View> views;
    std::vector<std::string> notes;  ///< decisions of the intensity conversion and assumptions of the geometry
    std::vector<std::filesystem::path> files;  ///< the JSON, images and masks read
};

/// Reads views.json (../formats.md): all four forms of geometry. Unknown keys, wrong types and malformed JSON are
/// errors that name the file, the line or the key's path ("views[1].camera.sdd_mm").
[[nodiscard]] ViewsFile read_views(const std::filesystem::path& path, ReadImages images);

/// Writes views.json with `projection`-exact cameras ("intrinsics" + "camera_from_world", sdd where known).
/// `image_names`: one per view, or empty for none; kind is written as "line-integral".
void write_views(const std::filesystem::path& path, const std::vector<View>& views,
                 const std::vector<std::string>& image_names);

}  // namespace raylign

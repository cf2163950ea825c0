#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "raylign/rigid_transform.h"
#include "raylign/view.h"
#include "raylign/volume.h"

namespace raylign::detail::apps {

/// What a viewer shows. Borrows for the call.
struct ViewerScene {
    std::string name;  ///< of the object
    const Volume& volume;
    const std::vector<View>& views;  ///< those without an image get an empty panel
    const RigidTransform& start_world_from_ct;
    std::string command;           ///< to go on with from start.json
    std::filesystem::path folder;  ///< where that command is given
    std::vector<std::string> notes;
};

/// Whether this build has the viewer: its script is bundled by npm.
[[nodiscard]] bool has_viewer();

/// A self-contained HTML page in which the object is placed on the X-rays by hand. Throws Error, kind unavailable,
/// where this build has no viewer; Error where the volume shows nothing.
[[nodiscard]] std::string viewer_page(const ViewerScene& scene);

}  // namespace raylign::detail::apps

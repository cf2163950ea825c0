#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "apps/report_page/page_script.h"
#include "apps/shared/json_text.h"
#include "apps/viewer/embedded.h"
#include "raylign/io/views.h"
#include "raylign/rigid_transform.h"
#include "raylign/view.h"
#include "raylign/volume.h"

namespace raylign::detail::apps {

/// What has a pose of its own. Borrows for the call.
struct ViewerObject {
    std::string name;
    const Volume& volume;
    bool moves = true;
};

/// X-rays and poses of one instant, packed.
struct ViewerFrame {
    int number = 1;
    std::vector<Json> xrays;                      ///< one per view, null where it has none
    std::vector<RigidTransform> world_from_ct{};  ///< one per object
    std::vector<std::string> status{};            ///< one per object; "" = nobody judged it
};

/// The command to go on with: begin, what the page hands out, end.
struct GoOn {
    struct KeyFrame {
        std::string object;
        int frame = 0;
        std::string words;  ///< --keyframe ...
    };
    std::string begin, end;
    std::vector<KeyFrame> key_frames{};  ///< that the run had
};

/// What a viewer shows. Borrows for the call.
struct ViewerScene {
    std::string title;
    std::vector<ViewerObject> objects;
    std::span<const View> views;          ///< cameras
    std::span<const ViewOrigin> origins;  ///< one per view
    std::vector<ViewerFrame> frames;      ///< at least one; several of a sequence
    bool is_sequence = false;
    int longest_side_px = kLargestImageSide_px;  ///< of the frames' X-rays
    GoOn go_on;
    std::filesystem::path folder;  ///< where the command to go on with is given
    std::vector<std::string> notes;
};

/// X-rays as a viewer carries them, in 16 bit for one instant, in 8 for one of many.
enum class XrayDepth { bits_8 = 1, bits_16 = 2 };
[[nodiscard]] std::vector<Json> viewer_xrays(std::span<const View> views, XrayDepth depth,
                                             int longest_side_px = kLargestImageSide_px);

/// Whether this build has the viewer: its script is bundled by npm.
[[nodiscard]] bool has_viewer();
/// Throws Error, kind unavailable, where it has not.
void refuse_without_viewer();

/// What the viewer's script draws. Throws Error where an object shows nothing.
[[nodiscard]] Json viewer_json(const ViewerScene& scene);

/// The viewer as a part of a report; empty where this build has none.
[[nodiscard]] PageScript viewer_script_of(const ViewerScene& scene);

/// A self-contained HTML page in which objects are placed on the X-rays by hand. Throws Error, kind unavailable, where
/// this build has no viewer; Error where an object shows nothing.
[[nodiscard]] std::string viewer_page(const ViewerScene& scene);

}  // namespace raylign::detail::apps

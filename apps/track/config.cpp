#include "apps/track/config.h"

#include <algorithm>

#include "apps/shared/json_text.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

Json volume_settings(const VolumeFlags& flags) {
    Json json{
        {"hu", flags.hu_preset},        {"hu_offset", flags.hu_offset}, {"attenuation", flags.attenuation},
        {"series", flags.series},       {"spacing", flags.spacing},     {"label", flags.label},
        {"object", flags.object},       {"materials", flags.materials}, {"mesh_spacing_mm", flags.mesh_spacing_mm},
        {"mesh_unit", flags.mesh_unit}, {"mesh_drr", flags.mesh_drr}};
    json["bone_threshold"] = or_null(flags.bone_threshold);
    json["clip"] = or_null(flags.clip);
    return json;
}

/// Files of poses and axes: the poses are in the rows, and axes say nothing about them.
bool is_beside(const std::string& path, const std::vector<ObjectFlags>& objects) {
    return std::ranges::any_of(objects, [&](const ObjectFlags& object) {
        const bool is_key = std::ranges::any_of(object.key_frames, [&](const auto& key) { return key.second == path; });
        return is_key || path == object.start || path == object.axes;
    });
}

}  // namespace

std::string track_config(const TrackCommandOptions& options, const TrackInputs& inputs, const BackendInfo& backend) {
    const std::vector<ObjectFlags> objects = objects_of(options);
    Json json{{"version", RAYLIGN_VERSION},
              {"rows", 3},  // what a row holds
              {"backend",
               {backend.name, backend.device, backend.instruction_set, backend.storage, backend.interpolation,
                backend.solver}},
              {"projector", options.backend.projector},
              {"step_mm", options.backend.step_mm},
              {"method", {options.method.name, options.method.metric, options.method.content}},
              {"no_robust", options.method.no_robust},
              {"levels", options.method.levels},
              {"max_iterations", options.method.max_iterations},
              {"seed", options.method.seed},
              {"search", {options.search.mode, options.search.range_mm, options.search.turn_deg}},
              {"search_starts", options.search.starts},
              {"time_limit_s", options.search.time_limit_s},
              {"auto_mask", options.views.auto_mask},
              {"undistorted", options.views.undistorted},
              {"saturation", options.views.saturation},
              {"recover", options.recover},
              {"max_jump_mm", options.max_jump_mm},
              {"thorough", options.is_thorough},
              {"depth_change_mm", options.depth_change_mm},
              {"frame_step", inputs.frame_step}};
    if (inputs.is_together) json["together"] = true;  // what one object's journal says stays as it was
    for (const ObjectFlags& object : objects) {
        json["objects"].push_back({{"name", object.name}, {"volume", volume_settings(object.volume)}});
    }
    for (const HashedFile& file : inputs.hashes.files) {
        if (!is_beside(file.path, objects)) json["inputs"].push_back(file.sha256);
    }
    return one_line(json);
}

}  // namespace raylign::detail::apps

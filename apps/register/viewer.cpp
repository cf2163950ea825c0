#include "apps/register/viewer.h"

#include <set>

#include "apps/shared/repeated.h"

namespace raylign::detail::apps {
namespace {

ViewerScene scene_of(const RegisterOptions& options, std::span<const View> views, std::span<const ViewOrigin> origins) {
    return {.title = "",
            .objects = {},
            .views = views,
            .origins = origins,
            .frames = {{.xrays = viewer_xrays(views, XrayDepth::bits_8)}},
            .go_on = options.go_on,
            .folder = std::filesystem::current_path(),
            .notes = {}};
}

void add_object(ViewerScene& scene, const ViewerObject& object, const RigidTransform& world_from_ct, bool is_ok) {
    scene.objects.push_back(object);
    scene.frames.front().world_from_ct.push_back(world_from_ct);
    scene.frames.front().status.emplace_back(is_ok ? "ok" : "doubtful");
}

}  // namespace

PageScript result_viewer(const RegisterRun& run) {
    if (run.options.no_viewer || !has_viewer()) return {};
    const std::vector<View> views = views_of(run.result, run.inputs.views);
    ViewerScene scene = scene_of(run.options, views, run.inputs.origins);
    add_object(scene, {run.options.volume.file.filename().string(), run.inputs.volume}, run.result.world_from_ct,
               run.result.ok);
    return viewer_script_of(scene);
}

PageScript result_viewer(const SceneRun& run) {
    if (run.options.no_viewer || !has_viewer()) return {};
    ViewerScene scene = scene_of(run.options, run.inputs.views, run.inputs.origins);
    for (std::size_t k = 0; k < run.inputs.objects.size(); ++k) {
        const SceneInput& object = run.inputs.objects[k];
        add_object(scene, {object.name, object.volume, object.mobility == Mobility::moves},
                   run.result.objects[k].world_from_ct, run.result.objects[k].ok);
    }
    return viewer_script_of(scene);
}

GoOn register_again(const CLI::App& command, const std::filesystem::path& folder) {
    const std::set<std::string> left_out{"--start", "--landmarks3d", "--landmarks", "--output", "--json", "--quiet"};
    const auto keeps = [&](const CLI::Option& option) { return !left_out.contains(option.get_name()); };
    return {repeated("register", command, keeps), quote_for_shell({"-o", folder.string()})};
}

}  // namespace raylign::detail::apps

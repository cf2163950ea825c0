#include "apps/register/scene_command.h"

#include <algorithm>
#include <iostream>

#include "apps/pictures/overlay.h"
#include "apps/register/dicom_out.h"
#include "apps/register/scene_report.h"
#include "apps/register/viewer.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/options.h"
#include "apps/shared/outputs.h"
#include "apps/shared/progress_bar.h"
#include "core/base/clock.h"
#include "core/base/error.h"
#include "core/io/files/output.h"
#include "raylign/io/pose.h"
#include "raylign/io/volume.h"

namespace raylign::detail::apps {
namespace {

constexpr const char* kSplitMap = "bones.nii.gz";
constexpr const char* kSplitNames = "bones.csv";

std::vector<std::string> scene_file_names(const SceneInputs& inputs) {
    std::vector<std::string> names{"report.json", "report.html"};
    for (const SceneInput& object : inputs.objects) {
        names.push_back("pose_" + object.name + ".json");
        names.push_back("pose_" + object.name + ".tfm");
    }
    if (inputs.split) names.insert(names.end(), {kSplitMap, kSplitNames});
    for (const View& view : inputs.views) {
        names.push_back("overlay_" + view.name + ".png");
        names.push_back(drr_file_name(view.name));
    }
    return names;
}

SceneResult register_with_progress(const SceneInputs& inputs, const RegistrationOptions& options, Backend& backend,
                                   const OutputFlags& output) {
    std::vector<SceneObject> objects;
    for (const SceneInput& object : inputs.objects) {
        objects.push_back({object.name, object.volume, object.start_world_from_ct, object.mobility, object.is_rest});
    }
    ProgressBar bar(output);
    const auto report = [&bar](const RegistrationProgress& progress) { bar.draw(progress_line(progress)); };
    SceneResult result = register_scene(objects, inputs.views, options, backend,
                                        {.on_progress = report, .stop = interrupt_token()}, inputs.limits);
    stop_if_interrupted();
    return result;
}

/// Where objects lie in one another at the poses found; what is left of the body has no surface to say so by.
std::vector<Collision> collisions_of(const SceneInputs& inputs, const SceneResult& result) {
    std::vector<PosedVolume> bones;
    std::vector<std::size_t> positions;
    for (std::size_t k = 0; k < inputs.objects.size(); ++k) {
        if (inputs.objects[k].is_rest) continue;
        bones.push_back({&inputs.objects[k].volume, result.objects[k].world_from_ct});
        positions.push_back(k);
    }
    std::vector<Collision> found = collisions(bones);
    for (Collision& collision : found) {
        collision.first = positions[collision.first];
        collision.second = positions[collision.second];
    }
    return found;
}

/// DRRs of all objects at poses: [view][object].
std::vector<std::vector<Image>> drrs_of(const SceneInputs& inputs, const RegistrationOptions& options,
                                        const std::vector<RigidTransform>& world_from_ct, Backend& backend) {
    std::vector<View> views = inputs.views;
    for (View& view : views) view.image = view.weights = {};
    std::vector<std::vector<Image>> drrs(views.size());
    for (std::size_t k = 0; k < inputs.objects.size(); ++k) {
        const auto session = backend.prepare({inputs.objects[k].volume, views, options.render, options.similarity});
        for (std::size_t v = 0; v < views.size(); ++v) drrs[v].push_back(session->render(world_from_ct[k], v));
        stop_if_interrupted();
    }
    return drrs;
}

Image sum_of(const std::vector<Image>& images) {
    Image sum = images.front();
    for (std::size_t i = 1; i < images.size(); ++i) {
        std::ranges::transform(sum.pixels, images[i].pixels, sum.pixels.begin(), std::plus<>());
    }
    return sum;
}

/// Returns the pictures of report.html.
std::vector<PageOverlay> stage_scene_pictures(const SceneRun& run, const RegistrationOptions& options, Backend& backend,
                                              OutputFolder& folder, DicomOut& dicom) {
    std::vector<RigidTransform> starts, found;
    std::vector<std::string> names;
    for (std::size_t k = 0; k < run.inputs.objects.size(); ++k) {
        starts.push_back(run.inputs.objects[k].start_world_from_ct);
        found.push_back(run.result.objects[k].world_from_ct);
        names.push_back(run.inputs.objects[k].name);
    }
    const auto before = drrs_of(run.inputs, options, starts, backend);
    const auto after = drrs_of(run.inputs, options, found, backend);
    std::vector<PageOverlay> overlays;
    const ResultTexts texts = result_texts(run.result.ok, all_reasons(run), found);
    for (std::size_t v = 0; v < run.inputs.views.size(); ++v) {
        const View& view = run.inputs.views[v];
        const Image all = sum_of(after[v]);
        write_image(folder.stage(drr_file_name(view.name)), all);
        const RgbImage picture =
            objects_picture({view.name, view.image, view.weights, names, before[v], after[v], all});
        write_png(folder.stage("overlay_" + view.name + ".png"), picture);
        dicom.stage(view, run.inputs.origins[v], picture, all, texts);
        const std::filesystem::path scratch = folder.stage("report.html").parent_path();
        overlays.push_back(page_overlay(view.name, view, sum_of(before[v]), all, scratch));
        for (std::size_t k = 0; k < names.size(); ++k) {
            if (run.inputs.objects[k].is_rest) continue;
            overlays.back().objects.push_back(page_layer(names[k], after[v][k], {}, scratch));
        }
    }
    return overlays;
}

/// The map of --segment-bones and its names, for --labels and --labels-table.
void stage_split(const BoneSplit& split, OutputFolder& folder) {
    Volume map{split.map.grid, std::vector<float>(split.map.labels.begin(), split.map.labels.end())};
    write_volume(folder.stage(kSplitMap), map);
    std::string table;
    for (const SplitBone& bone : split.bones) table += std::to_string(bone.label) + "," + bone.name + "\n";
    write_text(folder.stage(kSplitNames), table);
}

/// Writes everything but moves nothing into place yet. Returns report.json's text.
std::string stage_scene(SceneRun& run, const RegistrationOptions& options, Backend& backend, Clock::time_point begin,
                        OutputFolder& folder, DicomOut& dicom) {
    for (std::size_t k = 0; k < run.inputs.objects.size(); ++k) {
        const std::string stem = "pose_" + run.inputs.objects[k].name;
        write_pose(folder.stage(stem + ".json"), run.result.objects[k].world_from_ct);
        write_pose(folder.stage(stem + ".tfm"), run.result.objects[k].world_from_ct);
    }
    if (run.inputs.split) stage_split(*run.inputs.split, folder);
    const std::vector<PageOverlay> overlays = stage_scene_pictures(run, options, backend, folder, dicom);
    run.total_s = seconds_since(begin) - run.inputs.hashes.time_s;
    const std::string report = scene_json(run);
    write_text(folder.stage("report.json"), report);
    write_text(folder.stage("report.html"),
               report_page("scene", report, overlays, {{"machine", one_line(machine_json())}}, result_viewer(run)));
    return report;
}

}  // namespace

int run_register_scene(const RegisterOptions& options, const Invocation& invocation) {
    const auto begin = Clock::now();
    settle_conflicts(options.volume);
    settle_conflicts(options.backend);
    settle_conflicts(options.search, options.method);
    if (options.refine.refine_views || !options.refine.prior.empty() || !options.refine.kept_view.empty()) {
        throw Error("--refine-views is for one object: leave it out with several");
    }
    const RegistrationOptions registration = registration_options(options.method, options.search, options.backend);
    BackendChoice choice = choose_backend(options.backend);
    const SceneInputs inputs = read_scene_inputs(options);
    const std::vector<std::string> names = scene_file_names(inputs);
    refuse_to_overwrite(inputs.files, options.output.folder, names);
    OutputFolder folder(options.output.folder);  // before the work: an unwritable folder should not cost a run
    DicomOut dicom(options.dicom_out, inputs.views, inputs.files);
    SceneResult result = register_with_progress(inputs, registration, *choice.backend, options.output);
    SceneRun run{options, invocation, inputs, choice.backend->info(), choice.passed_over, std::move(result),
                 {},      names,      0};
    run.collisions = collisions_of(inputs, run.result);
    const std::string report = stage_scene(run, registration, *choice.backend, begin, folder, dicom);
    stop_if_interrupted();
    folder.commit();
    dicom.commit();
    if (options.output.json) {
        std::cout << report;
    } else if (!options.output.quiet) {
        std::cout << scene_summary(run);
    }
    return run.result.ok ? 0 : 1;
}

}  // namespace raylign::detail::apps

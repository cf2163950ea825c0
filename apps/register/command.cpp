#include <iostream>

#include "apps/objects/scene_inputs.h"
#include "apps/pictures/overlay.h"
#include "apps/register/dicom_out.h"
#include "apps/register/refined_views.h"
#include "apps/register/report.h"
#include "apps/register/scene_command.h"
#include "apps/register/summary.h"
#include "apps/register/viewer.h"
#include "apps/shared/commands.h"
#include "apps/shared/flags.h"
#include "apps/shared/help.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/options.h"
#include "apps/shared/outputs.h"
#include "apps/shared/progress_bar.h"
#include "core/base/clock.h"
#include "core/base/error.h"
#include "core/io/files/output.h"
#include "raylign/io/pose.h"

namespace raylign::detail::apps {
namespace {

std::string overlay_file_name(const std::string& view) { return "overlay_" + view + ".png"; }

constexpr const char* kRefinedViews = "views_refined.json";

std::vector<std::string> output_file_names(const RegisterInputs& inputs, const RegisterOptions& options) {
    std::vector<std::string> names{"pose.json", "pose.tfm", "report.json", "report.html"};
    if (!inputs.dicom_ct.empty()) names.emplace_back("pose.dcm");
    if (options.refine.refine_views) names.emplace_back(kRefinedViews);
    for (const View& view : inputs.views) {
        names.push_back(overlay_file_name(view.name));
        names.push_back(drr_file_name(view.name));
    }
    return names;
}

RegistrationResult run_with_progress(const RegisterInputs& inputs, const RegistrationOptions& options, Backend& backend,
                                     const OutputFlags& output) {
    ProgressBar bar(output);
    const auto report = [&bar](const RegistrationProgress& progress) { bar.draw(progress_line(progress)); };
    RegistrationResult result = register_volume(inputs.volume, inputs.views, inputs.start_world_from_ct, options,
                                                backend, {.on_progress = report, .stop = interrupt_token()});
    stop_if_interrupted();  // what was found until then is no reason to replace an older result
    return result;
}

/// Shown pixels per mm at the depth of the object's centre: the focal length over the depth.
std::optional<double> px_per_mm(const View& view, const RigidTransform& world_from_ct,
                                const Eigen::Vector3d& centre_ct) {
    const double depth_mm = (view.geometry.camera_from_world * (world_from_ct * centre_ct)).z();
    if (!(depth_mm > 0)) return std::nullopt;
    return view.geometry.camera.intrinsics_px(0, 0) / depth_mm;
}

/// Returns the pictures of report.html.
std::vector<PageOverlay> stage_pictures(const RegisterInputs& inputs, const RegistrationOptions& options,
                                        const RegistrationResult& result, Backend& backend, OutputFolder& folder,
                                        DicomOut& dicom) {
    std::vector<PageOverlay> overlays;
    const std::vector<View> as_found = views_of(result, inputs.views);
    std::vector<View> views = as_found;
    const ResultTexts texts = result_texts(result.ok, result.reasons, std::span(&result.world_from_ct, 1));
    for (View& view : views) view.image = view.weights = {};  // they are only rendered and need no channels
    const auto session = backend.prepare({inputs.volume, views, options.render, options.similarity});
    for (std::size_t i = 0; i < as_found.size(); ++i) {
        stop_if_interrupted();
        const View& view = as_found[i];
        const Image drr_start = session->render(inputs.start_world_from_ct, i);
        const Image drr_result = session->render(result.world_from_ct, i);
        write_image(folder.stage(drr_file_name(view.name)), drr_result);
        const RgbImage picture =
            overlay_picture({view.name, view.image, view.weights, drr_start, drr_result,
                             px_per_mm(view, result.world_from_ct, inputs.volume.grid.centre_ct_mm())});
        write_png(folder.stage(overlay_file_name(view.name)), picture);
        dicom.stage(view, inputs.origins[i], picture, drr_result, texts);
        overlays.push_back(
            page_overlay(view.name, view, drr_start, drr_result, folder.stage("report.html").parent_path()));
    }
    return overlays;
}

std::optional<TruthComparison> compare_with_truth(const RegisterInputs& inputs, const RegistrationResult& result) {
    if (!inputs.true_world_from_ct) return std::nullopt;
    std::vector<ViewGeometry> geometries;
    for (const View& view : inputs.views) geometries.push_back(view.geometry);
    const auto errors = [&](const RigidTransform& world_from_ct) {
        return target_errors(world_from_ct, *inputs.true_world_from_ct, inputs.targets_ct_mm, geometries);
    };
    return TruthComparison{errors(inputs.start_world_from_ct), errors(result.world_from_ct)};
}

/// Writes everything but moves nothing into place yet. Returns report.json's text.
std::string stage_outputs(RegisterRun& run, const RegistrationOptions& registration, Backend& backend,
                          Clock::time_point begin, OutputFolder& folder, DicomOut& dicom) {
    write_pose(folder.stage("pose.json"), run.result.world_from_ct);
    write_pose(folder.stage("pose.tfm"), run.result.world_from_ct);
    if (!run.inputs.dicom_ct.empty()) {
        write_pose(folder.stage("pose.dcm"), run.result.world_from_ct, run.inputs.dicom_ct);
    }
    if (run.options.refine.refine_views) {
        write_text(folder.stage(kRefinedViews), refined_views_json(views_of(run.result, run.inputs.views),
                                                                   run.inputs.origins, run.options.output.folder));
    }
    const std::vector<PageOverlay> overlays =
        stage_pictures(run.inputs, registration, run.result, backend, folder, dicom);
    run.total_s = seconds_since(begin) - run.inputs.hashes.time_s;
    const std::string report = report_json(run);
    write_text(folder.stage("report.json"), report);
    write_text(folder.stage("report.html"), register_page(report, overlays, result_viewer(run)));
    return report;
}

int run_register(const RegisterOptions& options, const Invocation& invocation) {
    const auto begin = Clock::now();
    settle_conflicts(options.volume);
    settle_conflicts(options.backend);
    settle_conflicts(options.search, options.method);
    const bool is_refined = settle_refinement(options.refine, options.method, options.search);
    // Checks names first: that is cheap.
    RegistrationOptions registration = registration_options(options.method, options.search, options.backend);
    BackendChoice choice = choose_backend(options.backend);
    const RegisterInputs inputs = read_register_inputs(options);
    if (is_refined) registration.refine_views = view_prior(options.refine, inputs.views);
    registration.rotation_centre_ct_mm = inputs.rotation_centre_ct_mm;
    const std::vector<std::string> names = output_file_names(inputs, options);
    refuse_to_overwrite(inputs.files, options.output.folder, names);
    OutputFolder folder(options.output.folder);  // before the work: an unwritable folder should not cost a run
    DicomOut dicom(options.dicom_out, inputs.views, inputs.files);

    RegistrationResult result = run_with_progress(inputs, registration, *choice.backend, options.output);
    std::optional<TruthComparison> truth = compare_with_truth(inputs, result);
    RegisterRun run{options,          invocation, inputs, choice.backend->info(), choice.passed_over, std::move(result),
                    std::move(truth), names,      0};
    const std::string report = stage_outputs(run, registration, *choice.backend, begin, folder, dicom);
    stop_if_interrupted();
    folder.commit();
    dicom.commit();

    if (options.output.json) {
        std::cout << report;
    } else if (!options.output.quiet) {
        std::cout << register_summary(run);
    }
    return run.result.ok ? 0 : 1;
}

void add_refine_flags(CLI::App& command, RefineFlags& flags) {
    command
        .add_flag("--refine-views", flags.refine_views,
                  "Correct the cameras, too, and leave views_refined.json; needs two views; default off")
        ->group(kMethodGroup);
    describe(command.add_option("--view-prior", flags.prior,
                                "How far cameras may be off: standard deviations of their turn and of their shift\n"
                                "at the object, per axis; default 2,10"),
             "DEG,MM", kMethodGroup);
    describe(command.add_option("--keep-view", flags.kept_view,
                                "The view whose camera stays, and defines the world; none: all share the correction;\n"
                                "default the first view"),
             "NAME", kMethodGroup);
}

void add_scene_flags(CLI::App& command, SceneFlags& flags) {
    add_several_objects_flags(command, flags);
    command.remove_option(command.get_option("--truth"));
    describe(command.add_option("--truth", flags.truths,
                                "True pose, of all objects or one, to report the error; default none"),
             "[NAME=]FILE ...", kStartGroup);
    describe(
        command.add_option("--joint", flags.joints,
                           "Angles between two objects; with =MM,DEG the most that they have moved against each\n"
                           "other since the CT, which then counts beside the X-rays; may be repeated; default none"),
        "PROXIMAL,DISTAL[=MM,DEG] ...", kOutputGroup);
    describe(command.add_option("--cardan", flags.cardan,
                                "Order of the joint's angles, proximal axis first, as track has it; default XYZ"),
             "NAME", kOutputGroup);
}

void add_page_flags(CLI::App& command, RegisterOptions& options) {
    describe(command.add_option("--dicom-out", options.dicom_out,
                                "Also leave overlay and DRR of each view as DICOM Secondary Captures of the patient's\n"
                                "study, where X-ray or CT is DICOM; default none"),
             "DIR", kOutputGroup);
    command
        .add_flag("--no-viewer", options.no_viewer,
                  "Leave out of report.html what corrects the result by hand, some MB; default off")
        ->group(kOutputGroup);
}

}  // namespace

void add_register_command(CLI::App& app, Job& job) {
    const auto options = std::make_shared<RegisterOptions>();
    CLI::App& command = *app.add_subcommand("register", "Find the pose of a CT in one or more X-rays");
    add_volume_flags(command, options->volume);
    command.get_option("--volume")->required(false)->option_text("FILE");
    add_views_flag(command, options->views, "views.json: images, cameras, masks");
    add_auto_mask_flag(command, options->views);
    add_saturation_flag(command, options->views);
    add_start_flags(command, options->start);
    add_truth_flags(command, options->truth);
    add_scene_flags(command, options->scene);
    add_method_flags(command, options->method);
    add_search_flags(command, options->search);
    add_refine_flags(command, options->refine);
    add_backend_flags(command, options->backend);
    add_output_flags(
        command, options->output,
        {.folder = "Folder for pose, report, overlays, DRRs; replaced when there is a result, doubtful or not",
         .json_file = "report.json",
         .quiet = "No progress bar, no summary"});
    add_page_flags(command, *options);
    finish_command(
        command,
        "  raylign register -v ct.nii.gz --views views.json --start pose.json -o result\n"
        "  raylign register -v dicom_folder --series 2 --views views.json -o result --backend cpu --threads 4\n"
        "  raylign register -v ct.mha --views xrays/views.json --truth pose.json -o result --json > report.json\n"
        "  raylign register -v ct.mha --views views.json --start pose.json -o result --refine-views --view-prior 1,5\n"
        "  raylign register -v ct.nii.gz --labels seg.nii.gz --object vertebrae_L3 --object vertebrae_L4 --rest body\n"
        "                   --views views.json --start pose.json -o lumbar\n"
        "  raylign register --bone radius=rad.tif --bone ulna=uln.tif --start radius=r.json --start ulna=u.json\n"
        "                   --views views.json --joint radius,ulna -o forearm");
    command.callback([options, &command, &job] {
        options->go_on = register_again(command, options->output.folder);
        job = [options](const Invocation& invocation) {
            if (is_scene(*options)) return run_register_scene(*options, invocation);
            RegisterOptions one = *options;
            settle_one_object(one);
            return run_register(one, invocation);
        };
    });
}

}  // namespace raylign::detail::apps

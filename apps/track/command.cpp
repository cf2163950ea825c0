#include <algorithm>
#include <cmath>
#include <iostream>

#include "apps/shared/append.h"
#include "apps/shared/commands.h"
#include "apps/shared/help.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/options.h"
#include "apps/shared/outputs.h"
#include "apps/shared/saturation.h"
#include "apps/track/config.h"
#include "apps/track/gaps.h"
#include "apps/track/pictures.h"
#include "apps/track/report.h"
#include "apps/track/smooth.h"
#include "apps/track/viewer.h"
#include "core/base/clock.h"
#include "core/base/error.h"
#include "core/base/linear_algebra.h"
#include "core/base/number_text.h"
#include "core/io/files/output.h"
#include "core/tracking/company.h"

namespace raylign::detail::apps {
namespace {

constexpr const char* kSmoothName = "trajectory_smooth.csv";

std::string joint_file_name(const std::string& joint) { return "joint_" + joint + ".csv"; }
std::string hashes_file_name(const std::string& view) { return "frames_" + view + ".sha256"; }
std::string tra_file_name(const std::string& object) { return object + ".tra"; }

std::vector<std::string> output_file_names(const TrackInputs& inputs) {
    std::vector<std::string> names{"trajectory.csv",    "track.json",           "track.html", FrameJournal::kName,
                                   TrackJournal::kName, TrackJournal::kOldName, kSmoothName};
    for (const TrackObject& object : inputs.objects) names.push_back(tra_file_name(object.name));
    for (const auto& [proximal, distal] : inputs.joints) {
        names.push_back(joint_file_name(inputs.objects[proximal].name + "_" + inputs.objects[distal].name));
    }
    for (const std::string& view : inputs.view_names()) names.push_back(hashes_file_name(view));
    return names;
}

std::vector<std::filesystem::path> all_inputs(const TrackInputs& inputs) {
    std::vector<std::filesystem::path> files = inputs.files;
    for (const FrameSet& set : inputs.frames) {
        for (const auto& frame : set.files) {
            if (frame && (files.empty() || files.back() != frame->file)) files.push_back(frame->file);
        }
    }
    return files;
}

/// Thousands of frames would swamp the report: their hashes go to a list as sha256sum makes it, and the report has that
/// of the list.
void stage_frame_hashes(TrackReport& report, OutputFolder& folder) {
    for (std::size_t v = 0; v < report.record.frame_hashes.size(); ++v) {
        const std::vector<HashedFile>& files = report.record.frame_hashes[v];
        if (files.size() == 1) report.hashed.files.push_back(files.front());
        if (files.size() < 2) continue;
        const std::string name = hashes_file_name(report.inputs.views.views[v].name);
        std::string text;
        for (const HashedFile& file : files) text += file.sha256 + "  " + file.path + "\n";
        const std::filesystem::path staged = folder.stage(name);
        write_text(staged, text);
        report.hashed.files.push_back({name, sha256_of_file(staged)});
        report.outputs.push_back(name);
    }
}

void stage_text(TrackReport& report, OutputFolder& folder, const std::string& name, const std::string& text) {
    write_text(folder.stage(name), text);
    report.outputs.push_back(name);
}

std::string trajectory_csv(const TrackInputs& inputs, const std::vector<TrajectoryRow>& rows) {
    const std::vector<std::string> views = inputs.view_names();
    std::string text = trajectory_header(views);
    for (const TrajectoryRow& row : rows) text += trajectory_line(row, views.size());
    return text;
}

void stage_tra_files(TrackReport& report, OutputFolder& folder) {
    for (const TrackObject& object : report.inputs.objects) {
        std::vector<std::optional<RigidTransform>> poses;
        for (const TrackFrame* frame : frames_of(report.record.rows, object.name)) poses.push_back(pose_of(*frame));
        try {
            stage_text(report, folder, tra_file_name(object.name), tra_text(poses, object.file_grid));
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::input || determinant_of(object.file_grid.direction) > 0) throw;
            report.notes.push_back("no " + tra_file_name(object.name) + ": " + error.what());
        }
    }
}

/// Writes everything but moves nothing into place yet. Returns track.json's text.
std::string stage_outputs(TrackReport& report, Backend& backend, Clock::time_point begin, OutputFolder& folder) {
    stage_text(report, folder, "trajectory.csv", trajectory_csv(report.inputs, report.record.rows));
    stage_tra_files(report, folder);
    report.jitters = jitters_of(report.record.rows, report.inputs);
    if (const SmoothWish wish = parse_smooth(report.options.smooth); wish.is_wanted) {
        stage_text(report, folder, kSmoothName,
                   trajectory_csv(report.inputs, smoothed_rows(report.record.rows, report.inputs, wish, report.notes)));
    }
    const CardanSequence sequence = CardanSequence::from_name(report.options.cardan);
    for (std::size_t j = 0; j < report.inputs.joints.size(); ++j) {
        const auto [proximal, distal] = report.inputs.joints[j];
        report.joints.push_back(
            joint_rows(report.record.rows, report.inputs.objects[proximal], report.inputs.objects[distal], sequence));
        stage_text(report, folder, joint_file_name(report.joint_name(j)), joint_csv(report.joints[j], sequence));
    }
    const std::vector<PageOverlay> pictures =
        report.complete() ? track_pictures(report, backend, folder.stage("track.html").parent_path())
                          : std::vector<PageOverlay>();
    report.total_s = seconds_since(begin) - report.inputs.hashes.time_s - report.record.hash_s;
    stage_frame_hashes(report, folder);
    report.outputs.insert(report.outputs.end(), {"track.json", "track.html"});
    const std::string json = track_json(report);
    write_text(folder.stage("track.json"), json);
    write_text(folder.stage("track.html"), report_page("track", json, pictures, {}, track_viewer(report)));
    return json;
}

/// --step is the projector's where that has one, and of frames else.
void settle_step(TrackCommandOptions& options) {
    double& step = options.backend.step_mm;
    if (step == 0 || options.backend.projector != "joseph") return;
    if (!(step >= 1 && step <= 1e6 && step == std::round(step))) {
        throw bad_value("--step", number_text(step),
                        "a whole number of frames from 1, or used with --projector trilinear");
    }
    if (options.range.step != 1) throw Error("--step and --every say the same: give one of them");
    options.range.step = static_cast<int>(step);
    step = 0;
}

/// Why several objects cannot be explained together; "" = they can.
std::string apart_because(const TrackOptions& track, const Backend& backend, const TrackInputs& inputs) {
    if (!Company::is_possible(track, backend)) return "together needs gauss-newton and a backend with derivatives";
    const std::optional<double> ceiling = parse_saturation(inputs.saturation);
    const bool may_saturate = ceiling ? std::isfinite(*ceiling) : inputs.has_metal;
    return may_saturate ? "what a saturated detector shows of several does not add up (--saturation none)" : "";
}

/// Several objects are explained together unless that is not wanted or not possible.
void settle_together(const TrackCommandOptions& options, const TrackOptions& track, const Backend& backend,
                     TrackInputs& inputs) {
    if (inputs.objects.size() < 2 || options.is_alone) return;
    const std::string why_not = apart_because(track, backend, inputs);
    inputs.is_together = why_not.empty();
    if (!inputs.is_together) inputs.notes.push_back("each bone is tracked as if the others were not there: " + why_not);
}

int run_track_command(const TrackCommandOptions& given, const Invocation& invocation) {
    const auto begin = Clock::now();
    TrackCommandOptions options = given;
    settle_step(options);
    settle_conflicts(options.volume);
    settle_conflicts(options.backend);
    settle_conflicts(options.search, options.method);
    (void)track_options(options, 1);  // checks names first: that is cheap
    (void)parse_smooth(options.smooth);
    BackendChoice choice = choose_backend(options.backend);
    TrackInputs inputs = read_track_inputs(options);
    TrackOptions track = track_options(options, inputs.frame_step);
    settle_together(options, track, *choice.backend, inputs);
    const std::filesystem::path& output = options.output.folder;
    refuse_to_overwrite(all_inputs(inputs), output, output_file_names(inputs));
    OutputFolder folder(output);  // before the work: an unwritable folder should not cost a run
    FrameJournal frames(output, track_config(options, inputs, choice.backend->info()));  // refuses a second run
    TrackJournal journal(output, inputs.view_names());

    TrackRecord record;
    try {
        record = run_track(inputs, track, *choice.backend, ProgressBar::show_of(options.output), {journal, frames},
                           {.stop = interrupt_token()});
    } catch (...) {  // before the first frame was done
        journal.remove();
        if (frames.is_empty()) std::filesystem::remove(output / FrameJournal::kName);
        throw;
    }
    TrackReport report{options, invocation, inputs, record, choice.backend->info(), choice.passed_over};
    report.hashed = inputs.hashes;
    report.notes = inputs.notes;
    append(report.notes, record.notes);
    if (options.joint_gap_mm != 0) {
        record.rows = rows_with_gaps_held(std::move(record.rows), inputs, options.joint_gap_mm, report.notes);
    }
    if (record.recalled > 0) {
        report.notes.push_back(std::to_string(record.recalled) + " of " + std::to_string(record.rows.size()) +
                               " rows are from an earlier run, by " + FrameJournal::kName +
                               "; remove it to begin anew");
    }
    const std::string json = stage_outputs(report, *choice.backend, begin, folder);
    folder.commit();
    journal.remove();
    if (options.output.json) {
        std::cout << json;
    } else if (!options.output.quiet) {
        std::cout << track_summary(report);
    }
    if (interrupted()) {
        throw Interrupted("interrupted after " + std::to_string(record.instants) + " of " +
                          std::to_string(inputs.frames.size()) + " frames: these are in " + output.string() +
                          ", and the same command goes on");
    }
    if (!report.complete()) std::rethrow_exception(record.stopped_by);
    return report.ok() ? 0 : 1;
}

void add_frame_flags(CLI::App& command, TrackCommandOptions& options) {
    describe(
        command.add_option("--frames", options.frames,
                           "A view's X-rays: multi-frame file, folder, or pattern as cam1.%04d.tif or \"cam1.*.tif\";\n"
                           "may be repeated; default \"frames\" or \"image\" of views.json, or FILE=PATTERN"),
        "VIEW=PATTERN ...", kInputGroup);
    describe(command.add_option("--first,--from", options.range.first,
                                "First frame by number; default the sequence's first"),
             "N", kInputGroup);
    describe(command.add_option("--last,--to", options.range.last, "Last frame by number; default the sequence's last"),
             "N", kInputGroup);
    describe(command.add_option("--every", options.range.step,
                                "Take every N-th number from the first (--step N, too, unless the projector\n"
                                "is trilinear); default 1"),
             "N", kInputGroup);
}

void add_object_and_start_flags(CLI::App& command, TrackCommandOptions& options) {
    describe(command.add_option("--bone", options.bones,
                                "An object of its own CT, or of -v by label of --labels (3, 3,4 or a name);\n"
                                "may be repeated; default one, \"object\", of -v"),
             "NAME=FILE|LABELS ...", kObjectGroup);
    describe(command.add_option(
                 "--start", options.starts,
                 "world_from_ct in the first frame, for all objects or one: pose.json, .tfm, trajectory.csv,\n"
                 ".tra, .jts, XMALab's CSV or \"dicom\"; may be repeated;\n"
                 "default: CT centre where central rays meet, patient axes"),
             "[NAME=]FILE ...", kStartGroup);
    describe(
        command.add_option("--keyframe", options.key_frames,
                           "world_from_ct in frame N, a correction by hand: tracked anew from there, both ways, until\n"
                           "it agrees with what was found before; may be repeated; default none"),
        "[NAME:]N=FILE ...", kStartGroup);
}

void add_track_flags(CLI::App& command, TrackCommandOptions& options) {
    describe(command.add_option("--recover", options.recover,
                                "Widest search for a frame that drifted or failed: none, near or global;\n"
                                "default global"),
             "NAME", kSearchGroup);
    describe(command.add_option("--max-jump", options.max_jump_mm,
                                "Farthest from the extrapolated pose, at the object's rim, without a search;\n"
                                "default 0: 3 mm + 4 x the median of the last frames (20 mm for the first)"),
             "MM", kSearchGroup);
    describe(command.add_option("--depth-change", options.depth_change_mm,
                                "One view: by how much depth changes from frame to frame, a standard deviation; where\n"
                                "the last frame lay then counts beside the image; default 0: not known"),
             "MM", kSearchGroup);
    describe(command.add_option("--joint-gap", options.joint_gap_mm,
                                "One view, several objects: by how much the difference of two neighbours' depths (of\n"
                                "--joint, else in order) changes over all frames, a standard deviation;\n"
                                "default 0: not known"),
             "MM", kSearchGroup);
    command
        .add_flag("--thorough", options.is_thorough,
                  "Register every frame in full, at ten times the time; default: frames whose\n"
                  "neighbours are sure are found on one level")
        ->group(kSearchGroup);
    command
        .add_flag("--alone", options.is_alone,
                  "Track each bone as if the others were not there; default: several are explained\n"
                  "together, so that one over another is no disturbance")
        ->group(kMethodGroup);
    describe(
        command.add_option("--smooth", options.smooth,
                           "Also leave trajectory_smooth.csv, a spline weighted by the expected errors: none, auto\n"
                           "(by cross-validation) or its strength; default none"),
        "none|auto|L", kOutputGroup);
    describe(command.add_option("--joint", options.joints, "Angles between two objects; may be repeated; default none"),
             "PROXIMAL,DISTAL ...", "Joints");
    describe(command.add_option("--cardan", options.cardan,
                                "Order of the joint's angles, proximal axis first: XYZ, XZY, YXZ, YZX, ZXY, ZYX;\n"
                                "default XYZ (x = patient left in CT axes: flexion first)"),
             "NAME", "Joints");
    describe(command.add_option("--axes", options.axes,
                                "Anatomical axes in an object's CT, JSON {\"raylign\": 1, \"ct_from_axes\": 4x4};\n"
                                "may be repeated; default: CT axes in the object's centre"),
             "NAME=FILE ...", "Joints");
}

}  // namespace

void add_track_command(CLI::App& app, Job& job) {
    const auto options = std::make_shared<TrackCommandOptions>();
    CLI::App& command = *app.add_subcommand("track", "Follow bones through a sequence of X-rays");
    add_volume_flags(command, options->volume);
    command.get_option("--volume")->required(false)->option_text("FILE");
    add_views_flag(command, options->views, "views.json: cameras, frames, masks");
    add_frame_flags(command, *options);
    add_auto_mask_flag(command, options->views);
    add_saturation_flag(command, options->views);
    add_object_and_start_flags(command, *options);
    add_method_flags(command, options->method);
    add_search_flags(command, options->search);
    add_track_flags(command, *options);
    add_backend_flags(command, options->backend);
    add_output_flags(command, options->output,
                     {.folder = "Folder for trajectory.csv, .tra, joints, report; replaced when there is a result, "
                                "doubtful or not",
                      .json_file = "track.json",
                      .quiet = "No progress bar, no summary"});
    command
        .add_flag("--no-viewer", options->no_viewer,
                  "Leave out of track.html what corrects frames by hand, some MB; default off")
        ->group(kOutputGroup);
    finish_command(
        command,
        "  raylign track -v radius.nii.gz --views views.json --start pose.json -o track\n"
        "  raylign track -v ct.nii.gz --views cam1.txt=cam1.%04d.tif --views cam2.txt=cam2.%04d.tif --first 10 -o "
        "track\n"
        "  raylign track --bone femur=femur.nii.gz --bone tibia=tibia.nii.gz --start femur=f.json --start "
        "tibia=t.json\n"
        "                --views views.json --frames AP=ap.dcm --frames LAT=lat.dcm --joint femur,tibia -o knee\n"
        "  raylign track -v ct.nii.gz --labels bones.nii.gz --bone femur=1 --bone tibia=2,3 --views views.json -o "
        "knee\n"
        "  raylign track --views wrist.cfg --hu-offset -1024 --start radius=radius.tra -o wrist\n"
        "The first frame is registered as `register` does it, the next from where the last ones point to.\n"
        "A frame that one view lacks, or that is empty, is a flagged gap. Exit code 1: a frame is not ok.");
    command.callback([options, &command, &job] {
        job = [options, &command](const Invocation& invocation) {
            options->go_on = track_again(command, *options);
            return run_track_command(*options, invocation);
        };
    });
}

}  // namespace raylign::detail::apps

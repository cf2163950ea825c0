#include <algorithm>
#include <array>
#include <iostream>

#include "apps/poses/opensim.h"
#include "apps/shared/commands.h"
#include "apps/shared/help.h"
#include "apps/shared/parse.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/io/dicom/dicom_series.h"
#include "core/io/dicom/dicom_tags.h"
#include "core/io/files/output.h"
#include "core/io/files/text.h"
#include "core/io/poses/autoscoper_trial.h"
#include "core/io/poses/pose_file.h"
#include "core/io/volumes/volume_grid.h"
#include "raylign/io/pose.h"

namespace raylign::detail::apps {
namespace {

enum class PosesOutput { trajectory, tra, jts, jtak, xmalab, pose, mot, sto, trc };

struct PosesOptions {
    std::filesystem::path file, output;
    std::string format;                ///< of the output; "" = by its extension
    std::vector<std::string> volumes;  ///< FILE or NAME=FILE
    std::filesystem::path trial;       ///< "" = none
    std::string spacing;               ///< of TIFF volumes
    std::string series;
    std::string object;  ///< "" = all
    std::optional<int> frame;
    std::string order;  ///< of .tra: rows, columns; "" = told by the numbers
    double unit_mm = 1;
    double rate_hz = 0;  ///< of OpenSim's files; 0 = not said
};

/// A volume and where its voxels lie as Autoscoper shows it.
struct NamedGrid {
    std::string name;
    VoxelGrid grid;
};

/// "FILE" or "NAME=FILE": the name, "" = none, and the file.
std::pair<std::string, std::filesystem::path> named_volume(const std::string& argument) {
    std::error_code ignored;
    if (argument.find('=') == std::string::npos || std::filesystem::exists(argument, ignored)) return {"", argument};
    return split_named(argument, "--volume", "NAME=FILE");
}

NamedGrid grid_of_volume(const std::string& argument, const PosesOptions& options) {
    const auto [name, file] = named_volume(argument);
    NamedGrid named{name, {}};
    VolumeReadOptions read;
    read.series = options.series;
    if (!options.spacing.empty()) read.spacing_mm = parse_triple(options.spacing, "--spacing");
    named.grid = read_volume_grid(file, read);
    if (named.name.empty()) named.name = file.stem().string();
    return named;
}

std::vector<NamedGrid> grids_of(const PosesOptions& options) {
    std::vector<NamedGrid> grids;
    for (const std::string& argument : options.volumes) grids.push_back(grid_of_volume(argument, options));
    if (!options.trial.empty()) {
        for (const TrialVolume& volume : read_autoscoper_trial(options.trial).volumes) {
            // As it is shown: in the frame of the flipped volume the voxels lie as in the file's own.
            grids.push_back(
                {volume.file.stem().string(), read_volume_grid(volume.file, {.spacing_mm = volume.voxel_mm})});
        }
    }
    if (options.object.empty() || grids.size() < 2) return grids;
    const auto found = std::ranges::find(grids, options.object, &NamedGrid::name);
    if (found == grids.end()) {
        throw bad_value("--object", options.object, "one of " + joined(grids, &NamedGrid::name, ", "));
    }
    return {*found};
}

std::vector<PoseSequence> read_poses(const PosesOptions& options, const std::vector<NamedGrid>& grids) {
    PoseFileOptions read;
    read.tra.unit_mm = options.unit_mm;
    if (options.order == "rows") read.tra.order = MatrixOrder::rows;
    if (options.order == "columns") read.tra.order = MatrixOrder::columns;
    for (const NamedGrid& named : grids) read.shown_grids.push_back(named.grid);
    if (pose_file_format(options.file) == PoseFileFormat::tra && grids.empty()) {
        throw Error(options.file.string() +
                    " tells poses in Autoscoper's frame of a volume: give --volume FILE (with --spacing for a TIFF) or "
                    "--trial FILE.cfg");
    }
    std::vector<PoseSequence> sequences = read_pose_file(options.file, read);
    for (std::size_t i = 0; i < sequences.size(); ++i) {
        if (sequences[i].object.empty() && i < grids.size()) sequences[i].object = grids[i].name;
    }
    if (options.object.empty()) return sequences;
    if (sequences.size() == 1) {
        sequences.front().object = options.object;
        return sequences;
    }
    const auto found = std::ranges::find(sequences, options.object, &PoseSequence::object);
    if (found == sequences.end()) {
        throw bad_value("--object", options.object, "one of " + joined(sequences, &PoseSequence::object, ", "));
    }
    return {*found};
}

PosesOutput output_of(const PosesOptions& options) {
    constexpr std::array<std::pair<const char*, PosesOutput>, 9> kNames = {{{"trajectory", PosesOutput::trajectory},
                                                                            {"tra", PosesOutput::tra},
                                                                            {"jts", PosesOutput::jts},
                                                                            {"jtak", PosesOutput::jtak},
                                                                            {"xmalab", PosesOutput::xmalab},
                                                                            {"pose", PosesOutput::pose},
                                                                            {"mot", PosesOutput::mot},
                                                                            {"sto", PosesOutput::sto},
                                                                            {"trc", PosesOutput::trc}}};
    std::string name = options.format;
    const std::string extension = lower_case(options.output.extension().string());
    if (name.empty() && !extension.empty()) name = extension.substr(1);
    if (options.format.empty() && name == "csv") name = "trajectory";
    if (options.format.empty() && (name == "json" || name == "tfm" || name == "txt" || name == "dcm")) name = "pose";
    for (const auto& [word, output] : kNames) {
        if (name == word) return output;
    }
    if (!options.format.empty()) {
        throw bad_value("--format", options.format, "one of trajectory, tra, jts, jtak, xmalab, pose, mot, sto, trc");
    }
    throw bad_value(
        "-o", options.output.string(),
        "a name ending in .csv (trajectory.csv, or XMALab's with --format xmalab), .tra, .jts, .jtak, .mot, .sto, "
        ".trc, .json, .tfm or .dcm");
}

/// Of formats that hold one object.
const PoseSequence& only_object(const std::vector<PoseSequence>& sequences, const PosesOptions& options) {
    if (sequences.size() == 1) return sequences.front();
    throw Error(options.output.string() + " holds one object, and there are " + std::to_string(sequences.size()) +
                ": choose by --object one of " + joined(sequences, &PoseSequence::object, ", "));
}

std::string tra_of(const PoseSequence& sequence, const std::vector<NamedGrid>& grids) {
    const auto named = std::ranges::find(grids, sequence.object, &NamedGrid::name);
    if (named == grids.end() && grids.size() != 1) {
        throw Error("a .tra file is in Autoscoper's frame of a volume: give --volume " +
                    (grids.empty() ? std::string("FILE") : sequence.object + "=FILE") + " or --trial FILE.cfg");
    }
    std::vector<std::optional<RigidTransform>> poses;
    for (const FramePose& frame : sequence.frames) poses.push_back(frame.world_from_ct);
    return tra_text(poses, named == grids.end() ? grids.front().grid : named->grid);
}

std::string table_text(PosesOutput output, const std::vector<PoseSequence>& sequences,
                       const std::vector<NamedGrid>& grids, const PosesOptions& options) {
    switch (output) {
        case PosesOutput::tra:
            return tra_of(only_object(sequences, options), grids);
        case PosesOutput::jts:
            return jointtrack_text(only_object(sequences, options), JointTrackFlavour::jts);
        case PosesOutput::jtak:
            return jointtrack_text(only_object(sequences, options), JointTrackFlavour::jtak);
        case PosesOutput::xmalab:
            return xmalab_text(sequences);
        case PosesOutput::mot:
        case PosesOutput::sto:
            return opensim_storage_text(sequences, options.output.stem().string(), options.rate_hz);
        case PosesOutput::trc:
            return opensim_markers_text(sequences, options.output.filename().string(), options.rate_hz);
        default:
            break;
    }
    std::string text = trajectory_header({});
    for (const TrajectoryRow& row : trajectory_rows(sequences)) text += trajectory_line(row, 0);
    return text;
}

/// Keeps one frame of each object.
void keep_frame(std::vector<PoseSequence>& sequences, int frame, const std::filesystem::path& file) {
    for (PoseSequence& sequence : sequences) {
        const auto found = std::ranges::find(sequence.frames, frame, &FramePose::frame);
        if (found == sequence.frames.end()) {
            throw bad_value("--frame", std::to_string(frame),
                            "in [" + std::to_string(sequence.frames.front().frame) + ", " +
                                std::to_string(sequence.frames.back().frame) + "]",
                            file.string());
        }
        const FramePose kept = *found;
        sequence.frames = {kept};
    }
}

RigidTransform pose_to_write(const std::vector<PoseSequence>& sequences, const PosesOptions& options) {
    const PoseSequence& sequence = only_object(sequences, options);
    if (sequence.frames.size() != 1) {
        throw Error(options.output.string() + " holds one pose, and there are " +
                    std::to_string(sequence.frames.size()) + ": choose by --frame N");
    }
    const FramePose& frame = sequence.frames.front();
    if (frame.world_from_ct) return *frame.world_from_ct;
    throw Error(options.file.string() + " has no pose for frame " + std::to_string(frame.frame));
}

/// The file of a DICOM CT whose patient, study and frame of reference a pose in DICOM gets; none for other formats.
std::filesystem::path referenced_ct(const PosesOptions& options) {
    if (lower_case(options.output.extension().string()) != ".dcm") return {};
    if (options.volumes.size() != 1) {
        throw Error(options.output.string() +
                    ": a pose in DICOM belongs to a CT in DICOM: name that by --volume (with --series where its folder "
                    "has several)");
    }
    const std::filesystem::path ct = named_volume(options.volumes.front()).second;
    if (!std::filesystem::is_directory(ct) && !looks_like_dicom(ct)) {
        throw Error(ct.string() + " is no DICOM file: a pose in DICOM belongs to a CT in DICOM; write .tfm or .json");
    }
    return choose_series(scan_dicom(ct), options.series).slices.front().path;
}

void print_summary(const std::vector<PoseSequence>& sequences) {
    for (const PoseSequence& sequence : sequences) {
        const auto poses = std::ranges::count_if(
            sequence.frames, [](const FramePose& frame) { return frame.world_from_ct.has_value(); });
        std::cout << (sequence.object.empty() ? "object" : sequence.object) << ": " << poses << " poses in "
                  << sequence.frames.size() << " frames\n";
    }
}

int run_poses(const PosesOptions& options) {
    if (!options.order.empty() && options.order != "rows" && options.order != "columns") {
        throw bad_value("--order", options.order, "rows or columns");
    }
    if (!(options.unit_mm > 0) || !(options.unit_mm <= 1000)) {
        throw bad_value("--unit", number_text(options.unit_mm), "in (0, 1000] mm");
    }
    const PosesOutput output = output_of(options);
    const bool is_opensim = output == PosesOutput::mot || output == PosesOutput::sto || output == PosesOutput::trc;
    if (is_opensim && !(options.rate_hz > 0 && options.rate_hz <= 1e6)) {
        throw bad_value("--rate", number_text(options.rate_hz),
                        "the frames a second, up to 1e6: OpenSim's files tell time", options.output.string());
    }
    std::error_code missing;
    if (std::filesystem::equivalent(options.file, options.output, missing)) {
        throw Error("-o " + options.output.string() + ": would overwrite the input; give another name");
    }
    const std::vector<NamedGrid> grids = grids_of(options);
    std::vector<PoseSequence> sequences = read_poses(options, grids);
    if (options.frame) keep_frame(sequences, *options.frame, options.file);
    if (output == PosesOutput::pose) {
        const RigidTransform pose = pose_to_write(sequences, options);
        write_pose(options.output, pose, referenced_ct(options));
    } else {
        write_text(options.output, table_text(output, sequences, grids, options));
    }
    print_summary(sequences);
    std::cout << "written " << options.output.string() << "\n";
    return 0;
}

void add_poses_flags(CLI::App& command, PosesOptions& options) {
    describe(command.add_option("-v,--volume", options.volumes,
                                "Volume whose frame a .tra is told in; may be repeated, in the order of the file;\n"
                                "the DICOM CT that a .dcm belongs to; default none"),
             "[NAME=]FILE ...", kInputGroup);
    describe(command.add_option("--trial", options.trial,
                                "Autoscoper trial (.cfg) that names these volumes and their voxel sizes; default none"),
             "FILE", kInputGroup);
    describe(command.add_option("--spacing", options.spacing, "Voxel sides of TIFF volumes in mm; default the file's"),
             "X,Y,Z", kInputGroup);
    describe(command.add_option("--series", options.series,
                                "Series of a DICOM folder, by UID or number; default the only one"),
             "UID|N", kInputGroup);
    describe(command.add_option("--order", options.order,
                                "Matrices of a .tra by rows or columns; default told by their last row"),
             "NAME", kInputGroup);
    describe(command.add_option("--unit", options.unit_mm,
                                "Millimetres per unit of length of a .tra or an XMALab table; default 1"),
             "MM", kInputGroup);
    describe(command.add_option("--object", options.object, "One object of several, or a name for it; default all"),
             "NAME", kObjectGroup);
    describe(command.add_option("--frame", options.frame, "One frame by its number, or its row; default all"), "N",
             kObjectGroup);
    describe(command
                 .add_option("-o,--output", options.output,
                             "Converted: .csv (trajectory.csv), .tra, .jts, .jtak, OpenSim's .mot, .sto, .trc;\n"
                             "of one frame .json, .tfm or .dcm")
                 ->required(),
             "FILE (required)", kOutputGroup);
    describe(command.add_option("--format", options.format,
                                "Of -o: trajectory, tra, jts, jtak, xmalab, mot, sto, trc or pose;\n"
                                "default by its extension"),
             "NAME", kOutputGroup);
    describe(command.add_option("--rate", options.rate_hz, "Frames a second, for OpenSim's files; default none"), "HZ",
             kOutputGroup);
}

}  // namespace

void add_poses_command(CLI::App& app, Job& job) {
    const auto options = std::make_shared<PosesOptions>();
    CLI::App& command = *app.add_subcommand("poses", "Convert poses and trajectories of other programs");
    command
        .add_option("file", options->file,
                    "trajectory.csv, Autoscoper's .tra, JointTrack's .jts or .jtak, XMALab's rigid body CSV,\n"
                    "pose.json, .tfm, .dcm")
        ->required()
        ->option_text("FILE (required)");
    add_poses_flags(command, *options);
    finish_command(command,
                   "  raylign poses fem.jts -o fem.csv\n"
                   "  raylign poses fem.jts --frame 1 -o start.json\n"
                   "  raylign poses pose.json --volume dicom_folder -o pose.dcm\n"
                   "  raylign poses radius.tra --volume radius.tif --spacing 0.4,0.4,0.625 -o trajectory.csv\n"
                   "  raylign poses track/trajectory.csv --object radius --trial wrist.cfg -o radius.tra\n"
                   "  raylign poses trajectory.csv -o bodies.csv --format xmalab\n"
                   "  raylign poses track/trajectory.csv --rate 100 -o knee.mot");
    command.callback([options, &job] { job = [options](const Invocation&) { return run_poses(*options); }; });
}

}  // namespace raylign::detail::apps

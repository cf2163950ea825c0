#include <algorithm>
#include <array>
#include <iostream>

#include "apps/geometry/check.h"
#include "apps/geometry/summary.h"
#include "apps/shared/commands.h"
#include "apps/shared/flags.h"
#include "apps/shared/help.h"
#include "apps/shared/parse.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/io/files/output.h"
#include "core/io/files/text.h"
#include "raylign/io/geometry.h"
#include "raylign/io/views.h"

namespace raylign::detail::apps {
namespace {

enum class OutputFormat { views_json, mayacam2, rtk, plastimatch, opencv, vectors };

struct GeometryOptions {
    std::vector<std::string> files;
    std::filesystem::path output;   ///< "" = print only
    std::string format;             ///< of the output; "" = by its extension
    std::string size, pixel_pitch;  ///< "W,H" [px], "X,Y" [mm]; "" = from the file
    double sdd_mm = 0;              ///< 0 = from the file
    std::string flip;               ///< "" = the format's own
    std::string undistorted;        ///< "true" or "false"; "" = not said
    bool json = false;
    bool check = false;  ///< files are folders of registered cases
};

GeometryHints hints_of(const GeometryOptions& options) {
    GeometryHints hints;
    if (!options.size.empty()) {
        const std::vector<double> size = parse_numbers(options.size, 2, "--size");
        constexpr double kLargest = 65536;
        for (const double side : size) {
            if (side >= 1 && side <= kLargest && side == static_cast<int>(side)) continue;
            throw bad_value("--size", options.size, "two whole numbers in [1, 65536], columns and rows");
        }
        hints.size_px = Eigen::Vector2i(static_cast<int>(size[0]), static_cast<int>(size[1]));
    }
    if (!options.pixel_pitch.empty()) {
        const std::vector<double> pitch = parse_numbers(options.pixel_pitch, 2, "--pixel-pitch");
        hints.pixel_pitch_mm = Eigen::Vector2d(pitch[0], pitch[1]);
    }
    hints.sdd_mm = given(options.sdd_mm);
    if (hints.sdd_mm && !(*hints.sdd_mm > 0)) throw bad_value("--sdd", number_text(options.sdd_mm), "positive");
    hints.undistorted = parse_truth(options.undistorted, "--undistorted");
    if (options.flip.empty()) return hints;
    if (options.flip == "none") hints.flip = ImageFlip::none;
    if (options.flip == "columns") hints.flip = ImageFlip::columns;
    if (options.flip == "rows") hints.flip = ImageFlip::rows;
    if (!hints.flip) throw bad_value("--flip", options.flip, "none, columns or rows");
    return hints;
}

std::string extension_of(const std::filesystem::path& path) { return lower_case(path.extension().string()); }

void append_file(const std::filesystem::path& path, const GeometryHints& hints, std::vector<ViewSummary>& summaries) {
    if (extension_of(path) != ".json") {
        const std::string format(format_name(geometry_format_of(path)));
        for (const GeometryView& view : read_geometry(path, hints)) {
            summaries.push_back({path, format, view.name, view.geometry, view.flip, view.distortion, view.assumptions});
        }
        return;
    }
    if (hints.size_px || hints.pixel_pitch_mm || hints.sdd_mm || hints.flip || hints.undistorted) {
        throw Error("--size, --pixel-pitch, --sdd, --flip and --undistorted are for files that lack them: " +
                    path.string() + " says them itself");
    }
    const ViewsFile file = read_views(path, ReadImages::never);
    for (std::size_t i = 0; i < file.views.size(); ++i) {
        // Notes begin with the view's name, or are about the file.
        std::vector<std::string> assumptions;
        for (const std::string& note : file.notes) {
            const bool is_of_view = note.starts_with(file.views[i].name + ": ");
            const std::vector<std::string> doubts = geometry_doubts(file.views[i].geometry);  // told apart
            if (is_of_view && std::ranges::find(doubts, note.substr(file.views[i].name.size() + 2)) != doubts.end())
                continue;
            if (is_of_view) assumptions.push_back(note.substr(file.views[i].name.size() + 2));
            const std::string place = "views[" + std::to_string(i) + "]";
            if (note.starts_with(place + ".")) assumptions.push_back(note);
        }
        summaries.push_back({path, "views.json", file.views[i].name, file.views[i].geometry, file.origins[i].flip,
                             file.origins[i].distortion, assumptions});
    }
}

OutputFormat output_format(const GeometryOptions& options) {
    constexpr std::array<std::pair<const char*, OutputFormat>, 6> kNames = {{{"views", OutputFormat::views_json},
                                                                             {"mayacam2", OutputFormat::mayacam2},
                                                                             {"rtk", OutputFormat::rtk},
                                                                             {"plastimatch", OutputFormat::plastimatch},
                                                                             {"opencv", OutputFormat::opencv},
                                                                             {"vectors", OutputFormat::vectors}}};
    for (const auto& [name, format] : kNames) {
        if (options.format == name) return format;
    }
    if (!options.format.empty()) {
        throw bad_value("--format", options.format, "one of views, mayacam2, rtk, plastimatch, opencv, vectors");
    }
    const std::string extension = extension_of(options.output);
    if (extension == ".json") return OutputFormat::views_json;
    if (extension == ".xml") return OutputFormat::rtk;
    if (extension == ".yml" || extension == ".yaml") return OutputFormat::opencv;
    if (extension == ".txt") return OutputFormat::mayacam2;
    if (extension == ".csv") return OutputFormat::vectors;
    throw bad_value(
        "-o", options.output.string(),
        "a name ending in .json (views.json), .txt (MayaCam 2), .xml (RTK), .yml (OpenCV) or .csv (vectors), or with "
        "--format");
}

/// Returns the text of the output; `notes` gets what its reader must know.
std::string converted(OutputFormat format, const std::vector<ViewSummary>& summaries, std::vector<std::string>& notes) {
    std::vector<ViewGeometry> geometries;
    std::vector<std::string> names;
    for (const ViewSummary& summary : summaries) {
        geometries.push_back(summary.geometry);
        names.push_back(summary.name);
        if (!summary.distortion || format == OutputFormat::opencv) continue;
        throw Error("this format has no place for the distortion of " + summary.name +
                    ": write views.json or OpenCV's YAML, or undistort the images and say --undistorted true");
    }
    if (format == OutputFormat::vectors) return vectors_text(geometries, names);
    if (format == OutputFormat::rtk) return rtk_text(geometries, notes);
    if (geometries.size() > 1) {
        throw Error("this format holds one view, and there are " + std::to_string(geometries.size()) +
                    ": give one file at a time, or write views.json, RTK's XML or vectors");
    }
    if (format == OutputFormat::mayacam2) return mayacam2_text(geometries.front());
    if (format == OutputFormat::plastimatch) return plastimatch_text(geometries.front());
    return opencv_text(geometries.front(), summaries.front().distortion);
}

/// Two files may call their views alike.
void number_equal_names(std::vector<ViewSummary>& summaries) {
    for (std::size_t i = 0; i < summaries.size(); ++i) {
        int same = 1;
        for (std::size_t k = 0; k < i; ++k) same += summaries[k].name == summaries[i].name;
        if (same > 1) summaries[i].name += "_" + std::to_string(same);
    }
}

void write_converted(const GeometryOptions& options, const std::vector<ViewSummary>& summaries,
                     std::vector<std::string>& notes) {
    for (const std::string& file : options.files) {
        std::error_code missing;
        if (std::filesystem::equivalent(file, options.output, missing)) {
            throw Error("-o " + options.output.string() + ": would overwrite the input; give another name");
        }
    }
    const OutputFormat format = output_format(options);
    if (format != OutputFormat::views_json) {
        write_text(options.output, converted(format, summaries, notes));
        return;
    }
    std::vector<View> views;
    std::vector<ImageFlip> flips;
    std::vector<std::optional<Distortion>> distortions;
    for (const ViewSummary& summary : summaries) {
        views.push_back({summary.name, summary.geometry, {}, {}});
        flips.push_back(summary.flip);
        distortions.push_back(summary.distortion);
    }
    write_views(options.output, views, {}, flips, distortions);
}

int run_check(const GeometryOptions& options) {
    const bool is_alone = options.output.empty() && options.format.empty() && options.size.empty() &&
                          options.pixel_pitch.empty() && options.sdd_mm == 0 && options.flip.empty() &&
                          options.undistorted.empty();
    if (!is_alone) throw Error("--check reads reports and converts nothing: leave the other options but --json out");
    std::cout << rig_check(options.files, options.json);
    return 0;
}

int run_geometry(const GeometryOptions& options) {
    if (options.check) return run_check(options);
    const GeometryHints hints = hints_of(options);
    if (options.output.empty() && !options.format.empty()) throw Error("--format needs -o FILE");
    if (!options.output.empty()) (void)output_format(options);
    std::vector<ViewSummary> summaries;
    for (const std::string& file : options.files) append_file(file, hints, summaries);
    number_equal_names(summaries);
    std::vector<std::string> notes;
    if (!options.output.empty()) write_converted(options, summaries, notes);
    std::cout << (options.json ? geometry_json(summaries) : geometry_text(summaries));
    if (options.json || options.output.empty()) return 0;
    for (const std::string& note : notes) std::cout << note << "\n";
    std::cout << "written " << options.output.string() << "\n";
    return 0;
}

}  // namespace

void add_geometry_command(CLI::App& app, Job& job) {
    const auto options = std::make_shared<GeometryOptions>();
    CLI::App& command = *app.add_subcommand("geometry", "Explain and convert the geometry of X-ray views");
    command
        .add_option("files", options->files,
                    "views.json, MayaCam 1 or 2, RTK XML, plastimatch matrix, OpenCV YAML, vectors, DICOM X-ray,\n"
                    "JointTrack calibration, Autoscoper trial")
        ->required()
        ->option_text("FILE ... (required)");
    describe(command.add_option("--size", options->size, "Image size in pixels; default the file's own"),
             "COLUMNS,ROWS", kStartGroup);
    describe(command.add_option("--pixel-pitch", options->pixel_pitch,
                                "Pixel sides at the detector, where the file lacks them; default its own"),
             "X,Y", kStartGroup);
    describe(command.add_option("--sdd", options->sdd_mm, "Source to detector; default the file's, or unknown"), "MM",
             kStartGroup);
    describe(command.add_option("--flip", options->flip,
                                "Stored pixels to reverse: none, columns or rows; default the format's own"),
             "NAME", kStartGroup);
    add_undistorted_flag(command, options->undistorted, kStartGroup);
    describe(command.add_option("-o,--output", options->output,
                                "Converted: .json (views.json), .txt (MayaCam 2), .xml (RTK), .yml (OpenCV),\n"
                                ".csv (vectors);\n"
                                "default none"),
             "FILE", kOutputGroup);
    describe(
        command.add_option("--format", options->format,
                           "Of -o: views, mayacam2, rtk, plastimatch, opencv or vectors; default by its extension"),
        "NAME", kOutputGroup);
    command
        .add_flag("--check", options->check,
                  "FILEs are folders that register wrote, or folders of such: corrections that their views\n"
                  "have in common, a rig's systematic error; default off")
        ->group(kStartGroup);
    command.add_flag("--json", options->json, "Print JSON; default off")->group(kOutputGroup);
    finish_command(command,
                   "  raylign geometry cam01.txt cam02.txt\n"
                   "  raylign geometry scan.xml --size 512,512 --pixel-pitch 0.8,0.8 -o views.json\n"
                   "  raylign geometry calibration.txt --size 1024,1024 -o views.json\n"
                   "  raylign geometry views.json -o geometry.xml\n"
                   "  raylign geometry --check results/case1 results/case2 results/case3");
    command.callback([options, &job] { job = [options](const Invocation&) { return run_geometry(*options); }; });
}

}  // namespace raylign::detail::apps

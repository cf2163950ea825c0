#include <iostream>

#include "apps/shared/commands.h"
#include "apps/shared/help.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/outputs.h"
#include "core/base/error.h"
#include "core/io/datasets/datasets.h"
#include "core/io/files/output.h"
#include "core/io/files/text.h"

namespace raylign::detail::apps {
namespace {

struct ImportOptions {
    std::string dataset;
    std::filesystem::path file, output;
    std::string specimen, patient;   ///< "" = the only one
    std::vector<std::string> views;  ///< none = all
    std::optional<int> border_px;
    std::optional<double> i0;
    bool quiet = false;
};

DatasetOptions dataset_options(const ImportOptions& options) {
    const bool is_deepfluoro = options.dataset == "deepfluoro";
    if (!is_deepfluoro && options.dataset != "ljubljana") {
        throw bad_value("data set", options.dataset, "deepfluoro or ljubljana");
    }
    if (is_deepfluoro && !options.patient.empty()) throw Error("--patient is for ljubljana: give --specimen NAME");
    if (!is_deepfluoro && !options.specimen.empty()) throw Error("--specimen is for deepfluoro: give --patient N");
    if (!is_deepfluoro && (options.border_px || options.i0)) throw Error("--border and --i0 are for deepfluoro");
    if (options.i0 && !(*options.i0 > 0)) throw bad_value("--i0", number_text(*options.i0), "positive");
    return {is_deepfluoro ? options.specimen : options.patient, options.views, options.border_px, options.i0};
}

int run_import(const ImportOptions& options) {
    const DatasetOptions dataset = dataset_options(options);
    const ImportedCase imported = options.dataset == "deepfluoro" ? read_deepfluoro(options.file, dataset)
                                                                  : read_ljubljana(options.file, dataset);
    stop_if_interrupted();
    refuse_to_overwrite({options.file}, options.output, case_file_names(imported));
    OutputFolder folder(options.output);
    const std::vector<std::string> names = write_case(imported, folder);
    stop_if_interrupted();
    folder.commit();
    if (options.quiet) return 0;
    for (const std::string& name : names) std::cout << (options.output / name).string() << "\n";
    return 0;
}

}  // namespace

void add_import_command(CLI::App& app, Job& job) {
    const auto options = std::make_shared<ImportOptions>();
    CLI::App& command = *app.add_subcommand("import", "Take a case out of a public data set");
    command
        .add_option("dataset", options->dataset, "deepfluoro (pelvis and femurs) or ljubljana (cerebral angiograms)")
        ->required()
        ->option_text("NAME (required)");
    command.add_option("file", options->file, "The data set's HDF5 file")->required()->option_text("FILE (required)");
    describe(command.add_option("--specimen", options->specimen, "Of deepfluoro, as 17-1882; default the only one"),
             "NAME", kInputGroup);
    describe(command.add_option("--patient", options->patient, "Of ljubljana, as 1; default the only one"), "N",
             kInputGroup);
    describe(command.add_option("--view", options->views,
                                "X-rays to take, by number or name; may be repeated;\n"
                                "default all (ljubljana: ap and lat, without ap-max and lat-max)"),
             "N ...", kInputGroup);
    describe(command.add_option("--border", options->border_px,
                                "Of deepfluoro: pixels masked at the rim; default 50 of 1536"),
             "PX", kInputGroup);
    describe(command.add_option("--i0", options->i0, "Of deepfluoro: open-beam intensity; default 65487"), "VALUE",
             kInputGroup);
    describe(command
                 .add_option("-o,--output", options->output,
                             "Folder for volume, labels, landmarks, X-rays, views.json, reference poses and README.md")
                 ->required(),
             "DIR (required)", kOutputGroup);
    command.add_flag("--quiet", options->quiet, "Do not list the files written; default off")->group(kOutputGroup);
    finish_command(command,
                   "  raylign import deepfluoro ipcai_2020_full_res_data.h5 --specimen 17-1882 --view 0 -o case\n"
                   "  raylign import ljubljana ljubljana.h5 --patient 1 -o case\n"
                   "  raylign study -v case/ct.mha --views case/views.json --truth case/pose_000_pelvis.json -o study");
    command.callback([options, &job] { job = [options](const Invocation&) { return run_import(*options); }; });
}

}  // namespace raylign::detail::apps

#include <iostream>

#include "apps/shared/commands.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/help.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/outputs.h"
#include "apps/shared/progress_bar.h"
#include "apps/study/report.h"
#include "apps/study/run.h"
#include "core/base/error.h"
#include "core/base/plain_text.h"
#include "core/io/files/output.h"

namespace raylign::detail::apps {
namespace {

constexpr const char* kJournal = "study.journal";

/// How setting up went on one rank.
struct Readiness {
    std::string config;
    int exit_code = 0;  ///< 0 = it can
    std::string problem;
};

Readiness get_ready(const StudyOptions& options, std::optional<Study>& study) {
    try {
        study.emplace(set_up_study(options));
        return {study_config(*study)};
    } catch (const Error& error) {
        return {"", exit_code_of(error.kind()), error.what()};
    }
}

/// Starts on every rank, or on none: returns 0 where all can, else the exit code of the first that cannot, on every
/// rank; rank 0 tells its problem.
int agreed_exit_code(Ranks& ranks, const Readiness& own) {
    const std::vector<std::string> configs = ranks.exchange(own.config);
    const std::vector<std::string> codes = ranks.exchange(std::to_string(own.exit_code));
    const std::vector<std::string> problems = ranks.exchange(own.problem);
    const auto tell = [&ranks](int rank, const std::string& problem) {
        if (ranks.rank() != 0) return;
        std::cerr << "raylign study: " + (rank == 0 ? "" : "rank " + std::to_string(rank) + ": ") +
                         plain_message(problem) + "\n";
    };
    for (int r = 0; r < ranks.size(); ++r) {
        if (codes[r] != "0") {
            tell(r, problems[r]);
            return std::stoi(codes[r]);
        }
        if (configs[r] != configs[0]) {
            tell(r, "sees other inputs, options or backends than rank 0 (another processor or file?)");
            return exit_code_of(ErrorKind::input);
        }
    }
    return 0;
}

void write_results(const Study& study, const StudyJournal& journal, const Invocation& invocation) {
    std::vector<TrialRecord> records;
    for (const auto& [number, record] : journal.trials()) records.push_back(record);
    OutputFolder folder(study.options.output.folder);
    write_text(folder.stage("study.csv"), trials_csv(study, records));
    write_text(folder.stage("study_starts.json"), study_starts_json(study));
    write_text(folder.stage("study.json"), study_json(study, journal, invocation));
    const std::filesystem::path page = folder.stage("study.html");
    write_text(page, study_page(study, journal, invocation, page.parent_path()));
    folder.commit();
}

/// What is left of the run once all ranks agree. `ranks` is null where the program runs alone.
int run_trials(const Study& study, const std::string& config, const Invocation& invocation, Ranks* ranks) {
    const OutputFlags& output = study.options.output;
    StudyJournal journal(output.folder / kJournal, config);
    check_records(study, journal);
    journal.note_run(study_run_note(invocation, ranks == nullptr ? 1 : ranks->size()));
    {
        ProgressBar bar(output);
        const auto show = [&bar](const StudyProgress& progress) { bar.draw(study_progress_line(progress)); };
        ranks == nullptr ? run_alone(study, journal, show) : run_as_first(study, journal, *ranks, show);
    }
    write_results(study, journal, invocation);
    if (output.json) {
        std::cout << study_json(study, journal, invocation);
    } else if (!output.quiet) {
        std::cout << study_summary(study, journal) << "written: " << output.folder.string()
                  << ": study.html study.csv study.json study_starts.json\n";
    }
    return 0;
}

int run_one_trial(const Study& study, long long trial) {
    const auto count = static_cast<long long>(study.trial_count());
    if (trial < 0 || trial >= count) {
        throw bad_value("--trial", std::to_string(trial), "in [0, " + std::to_string(count - 1) + "]");
    }
    for (const TrialRecord& record : run_trial(study, static_cast<std::size_t>(trial), {.stop = interrupt_token()})) {
        if (record.trial == static_cast<std::size_t>(trial)) std::cout << trial_line(record) << "\n";
    }
    return 0;
}

void check_outputs(const StudyOptions& options) {
    if (options.trial) return;
    if (options.output.folder.empty()) throw Error("-o is required (unless --trial runs a single one)");
    refuse_to_overwrite({options.volume.file, options.volume.labels, options.views, options.truth.truth,
                         options.truth.targets, options.detector.spectrum},
                        options.output.folder,
                        {kJournal, "study.csv", "study.json", "study_starts.json", "study.html"});
}

int run_study_with_ranks(const StudyOptions& options, const Invocation& invocation, Ranks& ranks) {
    std::optional<Study> study;
    const Readiness own = get_ready(options, study);
    if (const int code = agreed_exit_code(ranks, own); code != 0) return code;
    if (ranks.rank() == 0) return run_trials(*study, own.config, invocation, &ranks);
    run_as_worker(*study, ranks);
    return 0;
}

int run_study(const StudyOptions& given, const Invocation& invocation) {
    const StudyOptions options = settled(given);
    check_outputs(options);
    if (options.trial) return run_one_trial(set_up_study(options), *options.trial);
    if (const std::unique_ptr<Ranks> ranks = Ranks::join()) return run_study_with_ranks(options, invocation, *ranks);
    const Study study = set_up_study(options);
    return run_trials(study, study_config(study), invocation, nullptr);
}

void add_protocol_flags(CLI::App& command, StudyOptions& options) {
    describe(command.add_option("--preset", options.preset, preset_names() + ": defaults for the rest; default none"),
             "NAME", kStartGroup);
    describe(command.add_option("--bins", options.bins, "Intervals of the initial mTRE in mm; default 0:2:20"),
             "LOW:STEP:HIGH", kStartGroup);
    describe(command.add_option("--per-bin", options.per_bin, "Random starts in each interval; default 10"), "N",
             kStartGroup);
    describe(command.add_option("--view", options.view_sets,
                                "Register with these views, names with commas; repeat it for more sets;\n"
                                "default all views together"),
             "NAMES", kStartGroup);
    describe(command.add_option("--move", options.articulation.moves,
                                "Object of --labels that every trial moves at random against the rest; all are\n"
                                "registered together, success is told of each; may be repeated; default none"),
             "NAME ...", kStartGroup);
    describe(command.add_option("--by", options.articulation.by,
                                "Largest random shift and turn of --move, per axis; default 5,5"),
             "MM,DEG", kStartGroup);
    describe(
        command.add_option("--rest", options.rest, "With --move, as in register: body, still or none; default none"),
        "NAME", kStartGroup);
    add_detector_flags(command, options.detector, kStartGroup);
    add_seed_flag(command, options.method.seed, "Of starts and noise", kStartGroup);
    describe(command.add_option("--trial", options.trial,
                                "Run the trial of this number alone and print its record; default: the study"),
             "N", kOutputGroup);
}

void add_study_inputs(CLI::App& command, StudyOptions& options) {
    add_volume_flags(command, options.volume);
    describe(
        command.add_option("--views", options.views, "views.json; views without an image are simulated")->required(),
        "FILE (required)", kInputGroup);
    describe(
        command.add_option("--truth", options.truth.truth, "True world_from_ct: pose.json or ITK .tfm")->required(),
        "FILE (required)", kInputGroup);
    add_targets_flag(command, options.truth.targets, kInputGroup, ": rotation centre, TRE");
}

void add_study_method(CLI::App& command, StudyOptions& options) {
    MethodFlags& method = options.method;
    describe(command.add_option("--method", method.name, "As in register, or several with commas; default auto"),
             "NAMES", kMethodGroup);
    describe(command.add_option("--metric", method.metric, "gc or ncc, or both with a comma; default gc"), "NAMES",
             kMethodGroup);
    describe(command.add_option("--levels", method.levels, "Resolutions, as in register; default 0"), "N",
             kMethodGroup);
    describe(command.add_option("--max-iterations", method.max_iterations, "Most steps per level; default 100"), "N",
             kMethodGroup);
    add_backend_flags(command, options.backend);
    command.get_option("--backend")
        ->description(
            "One of those that `raylign info` lists, or several with commas;\n"
            "default auto: the best that runs");
    add_output_flags(command, options.output,
                     {.folder = "Folder for study.csv, study.json, study.html; a stopped study goes on there",
                      .json_file = "study.json",
                      .quiet = "No progress bar, no summary"});
    command.get_option("--output")->required(false);  // a single trial has no folder
}

}  // namespace

void add_study_command(CLI::App& app, Job& job) {
    const auto options = std::make_shared<StudyOptions>();
    options->backend.name.clear();  // empty = not given: a preset may say
    options->method.name.clear();
    options->method.metric.clear();
    CLI::App& command = *app.add_subcommand("study", "Measure robustness: many random starts, success rates, errors");
    add_study_inputs(command, *options);
    add_protocol_flags(command, *options);
    add_study_method(command, *options);
    finish_command(command,
                   "  raylign study -v ct.nii.gz --views views.json --truth pose.json --noise 20000 -o study\n"
                   "  raylign study -v ct.nii.gz --views views.json --truth pose.json --xray c-arm -o study\n"
                   "  raylign study -v ct.nii.gz --views views.json --truth pose.json --preset paper-table3 -o table3\n"
                   "  raylign study -v ct.nii.gz --labels seg.nii.gz --move vertebrae_L3 --move vertebrae_L4 --by 5,5\n"
                   "                --views views.json --truth pose.json -o bones\n"
                   "  raylign study ... --bins 0:4:40 --per-bin 50 --view AP --view AP,LAT --backend cpu,gl -o study\n"
                   "  mpirun -n 8 raylign study ... -o study        the same study, its trials on 8 processes\n"
                   "  raylign study ... --trial 17                  one trial again, alone");
    command.callback(
        [options, &job] { job = [options](const Invocation& invocation) { return run_study(*options, invocation); }; });
}

}  // namespace raylign::detail::apps

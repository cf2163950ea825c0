#include <iostream>

#include "apps/batch/report.h"
#include "apps/report_page/report_page.h"
#include "apps/shared/commands.h"
#include "apps/shared/flags.h"
#include "apps/shared/help.h"
#include "apps/shared/lines.h"
#include "apps/shared/outputs.h"
#include "apps/shared/progress_bar.h"
#include "core/base/clock.h"
#include "core/base/error.h"
#include "core/io/files/output.h"

namespace raylign::detail::apps {
namespace {

struct BatchOptions {
    std::filesystem::path jobs;
    bool retry = false;
    OutputFlags output;
};

std::string progress_text(std::size_t done, std::size_t all, const BatchOutcome& last, double left_s) {
    const double share = static_cast<double>(done) / static_cast<double>(all);
    return bar_text(share) + format(" %3.0f%%  %zu of %zu jobs  ", 100 * share, done, all) + last.name +
           format("  %.0f s left", left_s);
}

BatchPlan plan_of(const BatchOptions& options) {
    const std::filesystem::path file = std::filesystem::absolute(options.jobs).lexically_normal();
    return {read_jobs(options.jobs), file.parent_path(),
            std::filesystem::absolute(options.output.folder).lexically_normal(), options.retry};
}

int run_batch_command(const BatchOptions& options, const Invocation& invocation) {
    const std::unique_ptr<Ranks> ranks = Ranks::join();
    const BatchPlan plan = plan_of(options);
    if (ranks && ranks->rank() != 0) {
        run_batch_as_worker(plan, *ranks);
        return 0;
    }
    refuse_to_overwrite({options.jobs}, plan.folder, {"batch.json", "batch.csv", "batch.html", BatchJournal::kName});
    BatchJournal journal(plan.folder);
    OutputFolder folder(plan.folder);
    {
        ProgressBar bar(options.output);
        run_batch(plan, journal, ranks.get(),
                  [&](std::size_t done, std::size_t all, const BatchOutcome& last, double left_s) {
                      bar.draw(progress_text(done, all, last, left_s));
                  });
    }
    const std::string json = batch_json(plan, journal, invocation);
    write_text(folder.stage("batch.json"), json);
    write_text(folder.stage("batch.csv"), batch_csv(json));
    write_text(folder.stage("batch.html"), report_page("batch", json, {}));
    folder.commit();
    if (options.output.json) {
        std::cout << json;
    } else if (!options.output.quiet) {
        std::cout << batch_summary(json, options.output.folder);
    }
    for (const BatchJob& job : plan.jobs) {
        if (const BatchOutcome* outcome = journal.find(job); outcome == nullptr || outcome->exit_code != 0) return 1;
    }
    return 0;
}

}  // namespace

void add_batch_command(CLI::App& app, Job& job) {
    const auto options = std::make_shared<BatchOptions>();
    CLI::App& command = *app.add_subcommand("batch", "Registrations and tracks of a whole cohort, a row each");
    describe(command
                 .add_option("jobs", options->jobs,
                             "Table with a heading: name, command (register or track), and options without \"--\";\n"
                             "paths are relative to it, values between semicolons, yes for a flag")
                 ->required(),
             "JOBS.CSV (required)", kInputGroup);
    command.add_flag("--retry", options->retry, "Run those again that failed; default off")->group(kInputGroup);
    add_output_flags(command, options->output,
                     {.folder = "Folder for the jobs' folders, batch.csv, .json, .html; a stopped batch goes on there",
                      .json_file = "batch.json",
                      .quiet = "No progress, no summary"});
    finish_command(command,
                   "  raylign batch jobs.csv -o cohort\n"
                   "  mpirun -n 8 raylign batch jobs.csv -o cohort      on several processes, also of Slurm\n"
                   "jobs.csv:  name,volume,views,start,content\n"
                   "           case1,case1/ct.nii.gz,rig/views.json,case1/start.json,part\n"
                   "Every job's outcome is on the disk before the next begins; the same command goes on after a kill.\n"
                   "A job that fails (a missing file) costs that job. Exit code 1: a job is doubtful or failed.");
    command.callback([options, &job] {
        job = [options](const Invocation& invocation) { return run_batch_command(*options, invocation); };
    });
}

}  // namespace raylign::detail::apps

#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "apps/batch/jobs.h"
#include "apps/shared/line_journal.h"
#include "apps/study/ranks.h"

namespace raylign::detail::apps {

/// What became of a job.
struct BatchOutcome {
    std::string name, key;
    int exit_code = 0;    ///< 0 ok, 1 doubtful, else it failed
    std::string problem;  ///< what it said on standard error where it failed
    double time_s = 0;
};

/// batch.journal: the outcome of every job that has ended, on the disk before the next begins.
class BatchJournal {
public:
    explicit BatchJournal(const std::filesystem::path& folder);
    static constexpr const char* kName = "batch.journal";

    /// Null where the job has not ended, or was another one.
    [[nodiscard]] const BatchOutcome* find(const BatchJob& job) const;
    void append(const BatchOutcome& outcome);

private:
    LineJournal journal_;
    std::map<std::string, BatchOutcome> outcomes_;  ///< by name; the last of each
};
[[nodiscard]] std::string outcome_line(const BatchOutcome& outcome);
[[nodiscard]] BatchOutcome outcome_from(const std::string& line);

/// Runs a job as a process of this program in the folder of jobs.csv, with -o `folder`/NAME; what it says goes to
/// `folder`/NAME.log. `meanwhile` is called every few milliseconds. A stop is passed on, and thrown as Interrupted. The
/// process ends with this one, even where that is killed.
[[nodiscard]] BatchOutcome run_job(const BatchJob& job, const std::filesystem::path& jobs_folder,
                                   const std::filesystem::path& folder, const std::function<void()>& meanwhile);

struct BatchPlan {
    std::vector<BatchJob> jobs;
    std::filesystem::path jobs_folder, folder;  ///< both absolute
    bool retry = false;                         ///< run those again that failed
};
using BatchProgress = std::function<void(std::size_t done, std::size_t all, const BatchOutcome& last, double left_s)>;

/// Runs what has not ended, on this process and, as rank 0, on the others.
void run_batch(const BatchPlan& plan, BatchJournal& journal, Ranks* ranks, const BatchProgress& progress);
/// Another rank's side.
void run_batch_as_worker(const BatchPlan& plan, Ranks& ranks);

}  // namespace raylign::detail::apps

#pragma once

#include <functional>
#include <string>

#include "apps/study/journal.h"
#include "apps/study/ranks.h"

namespace raylign::detail::apps {

/// How far a study is.
struct StudyProgress {
    std::size_t done = 0, total = 0;
    double remaining_s = 0;  ///< from the pace of this run; 0 while nothing is known
};
/// Throws Error for a trial in the journal that the study has not.
void check_records(const Study& study, const StudyJournal& journal);

/// "[#####-----]  52%  312 of 600 trials  2 min 5 s left".
[[nodiscard]] std::string study_progress_line(const StudyProgress& progress);

using StudyCallback = std::function<void(const StudyProgress&)>;

/// Runs the trials that the journal lacks, one after the other, each written before the next begins. Throws
/// Interrupted on Ctrl-C: what is finished stays.
void run_alone(const Study& study, StudyJournal& journal, const StudyCallback& progress);

/// The same with several processes: rank 0 hands out trials one by one, runs some itself and writes all; it looks for
/// messages before each batch of evaluations, so that nobody waits for long.
void run_as_first(const Study& study, StudyJournal& journal, Ranks& ranks, const StudyCallback& progress);
/// What the other ranks do: runs what rank 0 sends until there is no more.
void run_as_worker(const Study& study, Ranks& ranks);

}  // namespace raylign::detail::apps

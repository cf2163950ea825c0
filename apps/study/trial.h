#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "apps/study/setup.h"
#include "raylign/registration.h"

namespace raylign::detail::apps {

/// What is kept of one trial: a line of the journal and a row of study.csv.
struct TrialRecord {
    std::size_t trial = 0, study_case = 0, interval = 0, repetition = 0;
    std::uint64_t seed = 0;
    double initial_mtre_mm = 0, initial_mrpd_mm = 0, final_mtre_mm = 0, final_mrpd_mm = 0;
    ErrorSplit split;  ///< by the case's first view
    bool success = false, verdict_ok = false;
    double expected_error_mm = std::numeric_limits<double>::quiet_NaN();  ///< NaN where none was given
    std::string reasons;                                                  ///< of the verdict
    std::string error;  ///< a run that ended by an error counts as failed and keeps its start pose
    double cost_initial = 0, cost_final = 0;
    std::uint64_t iterations = 0, evaluations = 0, linearizations = 0, bytes_to_host = 0;
    RigidTransform world_from_ct;
    double total_s = 0, prepare_s = 0, drr_s = 0, gradient_s = 0, reduction_s = 0, transfer_s = 0, optimizer_s = 0;
};

/// The trials of the registration that this one is of: itself, or one per object of those registered together. Where
/// `control` stops it, a record is of the best pose until then.
[[nodiscard]] std::vector<TrialRecord> run_trial(const Study& study, std::size_t trial, const RunControl& control);

/// Of several objects each starts off by its own; the seed is that of them all.
[[nodiscard]] StudyStart start_of_trial(const Study& study, const TrialPlace& place);

/// For the statistics.
[[nodiscard]] TrialOutcome outcome_of(const TrialRecord& record);

/// One line of JSON, without line feed, and back: every number bit for bit. Reading throws Error for anything else.
[[nodiscard]] std::string trial_line(const TrialRecord& record);
[[nodiscard]] TrialRecord trial_from_line(const std::string& line);

/// study.csv: a header and one row a trial in order of their numbers. Times come last: the other columns are the same
/// however the study was run.
[[nodiscard]] std::string trials_csv(const Study& study, const std::vector<TrialRecord>& records);

}  // namespace raylign::detail::apps

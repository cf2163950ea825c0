#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "apps/shared/line_journal.h"
#include "apps/study/trial.h"

namespace raylign::detail::apps {

/// The file of a study that a kill cannot hurt: a line of configuration, then a line per finished trial, each on the
/// disk before the next begins. A last line that was cut off is dropped on opening; its trial runs again.
class StudyJournal {
public:
    /// Opens or makes `file` and locks it until destroyed. `config`: the study's configuration, JSON in one line.
    /// Throws Error where the file belongs to another configuration (naming what differs), is damaged, is in use by
    /// another run, or cannot be written.
    StudyJournal(const std::filesystem::path& file, const std::string& config);

    /// Trials found in the file and appended since, by number.
    [[nodiscard]] const std::map<std::size_t, TrialRecord>& trials() const { return trials_; }
    /// What note_run was given, in this and earlier runs.
    [[nodiscard]] const std::vector<std::string>& runs() const { return runs_; }

    /// Returns when the line is on the disk. Throws Error for a trial that is there already, and with the system's
    /// reason where it cannot be written (the file is then as before).
    void append(const TrialRecord& record);
    /// Adds a line on who ran: JSON in one line.
    void note_run(const std::string& run);

private:
    void take_line(const std::string& line, const std::string& where);

    LineJournal journal_;
    std::map<std::size_t, TrialRecord> trials_;
    std::vector<std::string> runs_;
};

[[nodiscard]] std::vector<const TrialRecord*> records_of_case(const StudyJournal& journal, std::size_t study_case);
[[nodiscard]] std::vector<TrialOutcome> outcomes_of_case(const StudyJournal& journal, std::size_t study_case);

}  // namespace raylign::detail::apps

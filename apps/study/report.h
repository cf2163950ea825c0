#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/shared/invocation.h"
#include "apps/study/journal.h"

namespace raylign::detail::apps {

/// The settings that decide a trial's result, JSON in one line: what a journal may be continued with.
[[nodiscard]] std::string study_config(const Study& study);

/// Who runs a study: program, machine, processes; JSON in one line.
[[nodiscard]] std::string study_run_note(const Invocation& invocation, int processes);

/// study.json: settings, cases with their statistics per interval and over all, agreement of the backends, inputs with
/// hashes, machine.
[[nodiscard]] std::string study_json(const Study& study, const StudyJournal& journal, const Invocation& invocation);

/// What the page needs of every trial, JSON in one line.
[[nodiscard]] std::string trials_json(const StudyJournal& journal);

/// study_starts.json: every start with its number, seed and pose.
[[nodiscard]] std::string study_starts_json(const Study& study);

/// study.html: the same for people, with the worst trial of each case in pictures. `scratch`: a folder where a file may
/// stand for a moment.
[[nodiscard]] std::string study_page(const Study& study, const StudyJournal& journal, const Invocation& invocation,
                                     const std::filesystem::path& scratch);

/// For the terminal.
[[nodiscard]] std::string study_summary(const Study& study, const StudyJournal& journal);

}  // namespace raylign::detail::apps

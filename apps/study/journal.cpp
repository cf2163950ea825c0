#include "apps/study/journal.h"

#include "apps/shared/json_text.h"
#include "core/base/error.h"

namespace raylign::detail::apps {

StudyJournal::StudyJournal(const std::filesystem::path& file, const std::string& config)
    : journal_(file, config, {"raylign_study", "study", JournalKind::Other::refused}) {
    for (std::size_t i = 0; i < journal_.lines().size(); ++i) take_line(journal_.lines()[i], journal_.place_of(i));
}

void StudyJournal::take_line(const std::string& line, const std::string& where) {
    try {
        const Json entry = json_of_line(line);
        if (entry.is_object() && entry.contains("run")) {
            runs_.push_back(one_line(entry.at("run")));
            return;
        }
        const TrialRecord record = trial_from_line(line);
        if (!trials_.emplace(record.trial, record).second) {
            throw Error("trial " + std::to_string(record.trial) + " stands there twice");
        }
    } catch (const Error& problem) {
        throw Error(where + " is damaged: " + problem.what());
    }
}

void StudyJournal::append(const TrialRecord& record) {
    if (trials_.contains(record.trial)) {
        throw Error("trial " + std::to_string(record.trial) + " is in " + journal_.file().string() + " already");
    }
    journal_.append(trial_line(record));
    trials_.emplace(record.trial, record);
}

void StudyJournal::note_run(const std::string& run) {
    journal_.append("{\"run\":" + run + "}");
    runs_.push_back(run);
}

std::vector<const TrialRecord*> records_of_case(const StudyJournal& journal, std::size_t study_case) {
    std::vector<const TrialRecord*> list;
    for (const auto& [number, record] : journal.trials()) {
        if (record.study_case == study_case) list.push_back(&record);
    }
    return list;
}

std::vector<TrialOutcome> outcomes_of_case(const StudyJournal& journal, std::size_t study_case) {
    std::vector<TrialOutcome> list;
    for (const TrialRecord* record : records_of_case(journal, study_case)) list.push_back(outcome_of(*record));
    return list;
}

}  // namespace raylign::detail::apps

#include "apps/study/run.h"

#include <cmath>
#include <deque>
#include <sstream>

#include "apps/shared/interrupt.h"
#include "apps/shared/lines.h"
#include "apps/shared/progress_bar.h"
#include "core/base/clock.h"
#include "core/base/error.h"

namespace raylign::detail::apps {
namespace {

constexpr const char* kNoMore = "no more";
constexpr int kHandedOutAhead = 2;  // one to work on and one to go on with: no rank waits for rank 0's own trial

std::deque<std::size_t> unfinished(const Study& study, const StudyJournal& journal) {
    std::deque<std::size_t> trials;
    const std::size_t together = study.together();
    for (std::size_t first = 0; first < study.trial_count(); first += together) {
        std::size_t done = 0;
        for (std::size_t t = first; t < first + together; ++t) done += journal.trials().contains(t) ? 1 : 0;
        if (done < together) trials.push_back(first);
    }
    return trials;
}

/// Those that a run broken off while it wrote has left are the same again.
void append_new_records(StudyJournal& journal, const std::vector<TrialRecord>& records) {
    for (const TrialRecord& record : records) {
        if (!journal.trials().contains(record.trial)) journal.append(record);
    }
}

std::string lines_of(const std::vector<TrialRecord>& records) {
    std::string lines;
    for (const TrialRecord& record : records) lines += trial_line(record) + "\n";
    return lines;
}

std::vector<TrialRecord> records_from(const std::string& lines) {
    std::vector<TrialRecord> records;
    std::istringstream stream(lines);
    for (std::string line; std::getline(stream, line);) records.push_back(trial_from_line(line));
    return records;
}

class Pace {
public:
    Pace(const Study& study, const StudyJournal& journal, const StudyCallback& callback)
        : total_(study.trial_count()), before_(journal.trials().size()), callback_(callback) {}

    void tell(const StudyJournal& journal) const {
        const std::size_t done = journal.trials().size();
        const double elapsed_s = seconds_since(begin_);
        const double each_s = done > before_ ? elapsed_s / static_cast<double>(done - before_) : 0;
        if (callback_) callback_({done, total_, each_s * static_cast<double>(total_ - done)});
    }

private:
    std::size_t total_, before_;
    const StudyCallback& callback_;
    Clock::time_point begin_ = Clock::now();
};

void stop_study_if_interrupted() {
    if (interrupted()) {
        throw Interrupted("interrupted: the finished trials are kept; the same command goes on");
    }
}

std::vector<TrialRecord> run_unless_interrupted(const Study& study, std::size_t trial,
                                                const std::function<void()>& meanwhile) {
    stop_study_if_interrupted();
    std::vector<TrialRecord> records = run_trial(study, trial, {.stop = interrupt_token(), .meanwhile = meanwhile});
    stop_study_if_interrupted();
    return records;
}

/// Rank 0's side: which registrations are out, by their first trials, and what comes back.
class Dispatcher {
public:
    Dispatcher(const Study& study, StudyJournal& journal, Ranks& ranks, const Pace& pace)
        : todo_(unfinished(study, journal)), journal_(journal), ranks_(ranks), pace_(pace) {
        for (int ahead = 0; ahead < kHandedOutAhead; ++ahead) {
            for (int rank = 1; rank < ranks.size(); ++rank) hand_out(rank);
        }
    }

    void take_results() {
        while (const std::optional<RankMessage> message = ranks_.poll()) take(*message);
    }
    void wait_for_result() { take(ranks_.wait()); }

    [[nodiscard]] bool has_work() const { return !todo_.empty(); }
    [[nodiscard]] bool has_outstanding() const { return outstanding_ > 0; }
    [[nodiscard]] std::size_t next() {
        const std::size_t trial = todo_.front();
        todo_.pop_front();
        return trial;
    }

private:
    void hand_out(int rank) {
        if (todo_.empty()) return;
        ranks_.send(rank, std::to_string(next()));
        ++outstanding_;
    }
    void take(const RankMessage& message) {
        append_new_records(journal_, records_from(message.text));
        --outstanding_;
        hand_out(message.from);
        pace_.tell(journal_);
    }

    std::deque<std::size_t> todo_;
    std::size_t outstanding_ = 0;
    StudyJournal& journal_;
    Ranks& ranks_;
    const Pace& pace_;
};

}  // namespace

std::string study_progress_line(const StudyProgress& progress) {
    const double share = progress.total == 0 ? 1 : static_cast<double>(progress.done) / progress.total;
    const auto left_s = static_cast<long long>(std::ceil(progress.remaining_s));
    std::string left;
    if (left_s >= 3600) {
        left = format("  %lld h %lld min left", left_s / 3600, left_s % 3600 / 60);
    } else if (left_s >= 60) {
        left = format("  %lld min %lld s left", left_s / 60, left_s % 60);
    } else if (left_s > 0) {
        left = format("  %lld s left", left_s);
    }
    return bar_text(share) +
           format(" %3.0f%%  %zu of %zu trials", std::floor(100 * share), progress.done, progress.total) + left;
}

void check_records(const Study& study, const StudyJournal& journal) {
    for (const auto& [number, record] : journal.trials()) {
        const bool is_in = number < study.trial_count();
        const TrialPlace place = is_in ? trial_place(study, number) : TrialPlace();
        if (is_in && place.study_case == record.study_case && place.interval == record.interval &&
            place.repetition == record.repetition) {
            continue;
        }
        throw Error("the study's journal is damaged: trial " + std::to_string(number) +
                    " is not where the study has it; give another folder");
    }
}

void run_alone(const Study& study, StudyJournal& journal, const StudyCallback& progress) {
    const Pace pace(study, journal, progress);
    pace.tell(journal);
    for (const std::size_t trial : unfinished(study, journal)) {
        append_new_records(journal, run_unless_interrupted(study, trial, [] {}));
        pace.tell(journal);
    }
}

void run_as_first(const Study& study, StudyJournal& journal, Ranks& ranks, const StudyCallback& progress) {
    const Pace pace(study, journal, progress);
    pace.tell(journal);
    Dispatcher dispatcher(study, journal, ranks, pace);
    while (dispatcher.has_work()) {
        const std::vector<TrialRecord> own =
            run_unless_interrupted(study, dispatcher.next(), [&dispatcher] { dispatcher.take_results(); });
        append_new_records(journal, own);
        pace.tell(journal);
        dispatcher.take_results();
    }
    while (dispatcher.has_outstanding()) dispatcher.wait_for_result();
    for (int rank = 1; rank < ranks.size(); ++rank) ranks.send(rank, kNoMore);
}

void run_as_worker(const Study& study, Ranks& ranks) {
    for (;;) {
        const RankMessage message = ranks.wait();
        if (message.text == kNoMore) return;
        ranks.send(0, lines_of(run_unless_interrupted(study, std::stoull(message.text), [] {})));
    }
}

}  // namespace raylign::detail::apps

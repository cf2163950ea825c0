#include "apps/batch/run.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <csignal>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <deque>
#include <fstream>
#include <sstream>
#include <thread>

#include "apps/shared/interrupt.h"
#include "apps/shared/json_text.h"
#include "core/base/clock.h"
#include "core/base/error.h"
#include "core/base/plain_text.h"
#include "core/io/files/temporary_file.h"

namespace raylign::detail::apps {
namespace {

constexpr const char* kEnd = "no more";
constexpr auto kLook = std::chrono::milliseconds(5);

/// In the new process: only what may be done between fork and exec.
[[noreturn]] void become(const std::vector<char*>& arguments, const char* folder, const char* log, pid_t parent) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(127);  // it was gone before
    const int file = ::open(log, O_WRONLY | O_CREAT | O_TRUNC, 0666);
    const int nothing = ::open("/dev/null", O_RDWR);
    if (::chdir(folder) != 0 || file < 0 || nothing < 0) ::_exit(127);
    ::dup2(nothing, STDIN_FILENO);
    ::dup2(nothing, STDOUT_FILENO);
    ::dup2(file, STDERR_FILENO);
    ::execv("/proc/self/exe", arguments.data());
    ::_exit(127);
}

/// Waits for the process; passes a stop on, once.
int wait_for(pid_t process, const std::function<void()>& meanwhile) {
    bool is_told = false;
    for (int status = 0;;) {
        const pid_t ended = ::waitpid(process, &status, WNOHANG);
        if (ended == process) return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
        if (ended < 0 && errno != EINTR) throw Error("a job's process cannot be waited for: " + system_reason(errno));
        if (interrupted() && !is_told) {
            is_told = true;
            ::kill(process, SIGTERM);
        }
        meanwhile();
        std::this_thread::sleep_for(kLook);
    }
}

std::string text_of(const std::filesystem::path& file) {
    std::ifstream stream(file);
    std::stringstream text;
    text << stream.rdbuf();
    return text.str();
}

/// The last line that says something: what came before it is progress.
std::string last_line(const std::string& text) {
    std::istringstream lines(text);
    std::string last;
    for (std::string line; std::getline(lines, line);) {
        if (!line.empty()) last = line;
    }
    return plain_message(last);
}

void stop_batch_if_interrupted() {
    if (interrupted()) throw Interrupted("interrupted: the jobs that ended are kept; the same command goes on");
}

}  // namespace

std::string outcome_line(const BatchOutcome& outcome) {
    return one_line(Json{{"name", outcome.name},
                         {"key", outcome.key},
                         {"exit_code", outcome.exit_code},
                         {"problem", outcome.problem},
                         {"time_s", outcome.time_s}});
}

BatchOutcome outcome_from(const std::string& line) {
    const Json json = json_of_line(line);
    try {
        return {json.at("name").get<std::string>(), json.at("key").get<std::string>(), json.at("exit_code").get<int>(),
                json.at("problem").get<std::string>(), json.at("time_s").get<double>()};
    } catch (const nlohmann::json::exception& problem) {
        throw Error(std::string("no outcome of a job: ") + problem.what());
    }
}

BatchJournal::BatchJournal(const std::filesystem::path& folder)
    : journal_(folder / kName, "{\"format\":1}", {"raylign_batch", "batch", JournalKind::Other::refused}) {
    for (std::size_t i = 0; i < journal_.lines().size(); ++i) {
        try {
            BatchOutcome outcome = outcome_from(journal_.lines()[i]);
            outcomes_.insert_or_assign(outcome.name, outcome);
        } catch (const Error& problem) {
            throw Error(journal_.place_of(i) + " is damaged: " + problem.what());
        }
    }
}

const BatchOutcome* BatchJournal::find(const BatchJob& job) const {
    const auto found = outcomes_.find(job.name);
    return found == outcomes_.end() || found->second.key != job.key() ? nullptr : &found->second;
}

void BatchJournal::append(const BatchOutcome& outcome) {
    journal_.append(outcome_line(outcome));
    outcomes_.insert_or_assign(outcome.name, outcome);
}

BatchOutcome run_job(const BatchJob& job, const std::filesystem::path& jobs_folder, const std::filesystem::path& folder,
                     const std::function<void()>& meanwhile) {
    const auto begin = Clock::now();
    const std::filesystem::path log = folder / (job.name + ".log");
    std::vector<std::string> words{"raylign", job.command};
    words.insert(words.end(), job.arguments.begin(), job.arguments.end());
    words.insert(words.end(), {"-o", (folder / job.name).string()});
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const pid_t parent = ::getpid(), process = ::fork();
    if (process < 0) throw Error("no process for " + job.name + ": " + system_reason(errno), ErrorKind::unavailable);
    if (process == 0) become(arguments, jobs_folder.c_str(), log.c_str(), parent);
    BatchOutcome outcome{job.name, job.key(), wait_for(process, meanwhile), "", 0};
    stop_batch_if_interrupted();  // what was stopped has not ended
    outcome.time_s = seconds_since(begin);
    const std::string said = text_of(log);
    if (outcome.exit_code > 1) {
        outcome.problem = said.empty() ? "ended with code " + std::to_string(outcome.exit_code) : last_line(said);
    } else if (said.empty()) {
        std::error_code ignored;
        std::filesystem::remove(log, ignored);
    }
    return outcome;
}

namespace {

/// Rank 0's side, or all there is.
class BatchRun {
public:
    BatchRun(const BatchPlan& plan, BatchJournal& journal, Ranks* ranks, const BatchProgress& progress)
        : plan_(plan), journal_(journal), ranks_(ranks), progress_(progress) {
        for (std::size_t i = 0; i < plan.jobs.size(); ++i) {
            const BatchOutcome* known = journal.find(plan.jobs[i]);
            const bool again = known != nullptr && known->exit_code > 1 && plan.retry;
            if (known == nullptr || again) todo_.push_back(i);
        }
        before_ = plan.jobs.size() - todo_.size();
    }

    void run() {
        for (int rank = 1; ranks_ != nullptr && rank < ranks_->size(); ++rank) hand_out(rank);
        while (!todo_.empty()) {
            stop_batch_if_interrupted();
            take(run_job(plan_.jobs[next()], plan_.jobs_folder, plan_.folder, [this] { take_results(); }));
        }
        while (outstanding_ > 0) {
            const RankMessage message = ranks_->wait();
            take_from(message);
        }
        for (int rank = 1; ranks_ != nullptr && rank < ranks_->size(); ++rank) ranks_->send(rank, kEnd);
    }

private:
    std::size_t next() {
        const std::size_t job = todo_.front();
        todo_.pop_front();
        return job;
    }
    void hand_out(int rank) {
        if (todo_.empty()) return;
        ranks_->send(rank, std::to_string(next()));
        ++outstanding_;
    }
    void take_results() {
        if (ranks_ == nullptr) return;
        while (const std::optional<RankMessage> message = ranks_->poll()) take_from(*message);
    }
    void take_from(const RankMessage& message) {
        --outstanding_;
        hand_out(message.from);
        take(outcome_from(message.text));
    }
    void take(const BatchOutcome& outcome) {
        journal_.append(outcome);
        ++done_;
        const std::size_t all = plan_.jobs.size(), left = all - before_ - done_;
        const double each_s = seconds_since(begin_) / static_cast<double>(done_);
        progress_(before_ + done_, all, outcome, each_s * static_cast<double>(left));
    }

    const BatchPlan& plan_;
    BatchJournal& journal_;
    Ranks* ranks_;
    const BatchProgress& progress_;
    std::deque<std::size_t> todo_;
    std::size_t before_ = 0, done_ = 0;
    int outstanding_ = 0;
    Clock::time_point begin_ = Clock::now();
};

}  // namespace

void run_batch(const BatchPlan& plan, BatchJournal& journal, Ranks* ranks, const BatchProgress& progress) {
    BatchRun(plan, journal, ranks, progress).run();
}

void run_batch_as_worker(const BatchPlan& plan, Ranks& ranks) {
    for (;;) {
        const RankMessage message = ranks.wait();
        if (message.text == kEnd) return;
        const BatchJob& job = plan.jobs.at(std::stoull(message.text));
        ranks.send(0, outcome_line(run_job(job, plan.jobs_folder, plan.folder, [] {})));
    }
}

}  // namespace raylign::detail::apps

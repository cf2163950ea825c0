#include "apps/study/journal.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <nlohmann/json.hpp>
#include <system_error>

#include "core/base/error.h"

namespace raylign::detail::apps {
namespace {

using AnyOrder = nlohmann::json;  // the order of keys says nothing when settings are compared

constexpr const char* kHeaderKey = "raylign_study";

Error failure(const std::filesystem::path& file, const std::string& what) {
    return Error(file.string() + " " + what + ": " + std::generic_category().message(errno));
}

std::string read_all(int descriptor, const std::filesystem::path& file) {
    std::string text;
    std::vector<char> block(1 << 16);
    for (;;) {
        const ssize_t count = ::read(descriptor, block.data(), block.size());
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) throw failure(file, "cannot be read");
        if (count == 0) return text;
        text.append(block.data(), static_cast<std::size_t>(count));
    }
}

AnyOrder header_of(const std::string& line, const std::filesystem::path& file) {
    try {
        const Json header = json_of_line(line);
        if (header.is_object() && header.contains(kHeaderKey)) return AnyOrder(header);
    } catch (const Error&) {  // it may be anything
    }
    throw Error(file.string() + " is not the journal of a study: give another folder");
}

/// The first setting in which two configurations differ, for people.
std::string difference(const AnyOrder& there, const AnyOrder& here) {
    for (const auto& [key, value] : here.items()) {
        if (!there.contains(key)) return key + " was not recorded there";
        if (there.at(key) != value) return key + " is " + there.at(key).dump() + " there and " + value.dump() + " here";
    }
    return "it has settings that are not known here";
}

}  // namespace

StudyJournal::StudyJournal(const std::filesystem::path& file, const std::string& config) : file_(file) {
    std::error_code ignored;
    std::filesystem::create_directories(file.parent_path(), ignored);  // a failure shows on opening
    descriptor_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NONBLOCK, 0666);
    if (descriptor_ < 0) throw failure(file, "cannot be written");
    try {
        struct stat status {};
        if (::fstat(descriptor_, &status) != 0) throw failure(file, "cannot be read");
        if (!S_ISREG(status.st_mode)) throw Error(file.string() + " is no regular file: give another folder");
        if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
            if (errno == EWOULDBLOCK) throw Error(file.string() + ": another run is working on this study");
            // Some network file systems know no locks: better to work without than not at all.
        }
        read(config);
    } catch (...) {
        ::close(descriptor_);
        throw;
    }
}

StudyJournal::~StudyJournal() { ::close(descriptor_); }

void StudyJournal::read(const std::string& config) {
    const std::string text = read_all(descriptor_, file_);
    std::size_t number = 0, begin = 0;
    for (std::size_t end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
        const std::string line = text.substr(begin, end - begin);
        if (++number > 1) {
            take_line(line, number);
            continue;
        }
        const AnyOrder header = header_of(line, file_);
        const AnyOrder here = AnyOrder::parse(config);
        if (header.at(kHeaderKey) != here) {
            throw Error(file_.string() + " belongs to another study: " + difference(header.at(kHeaderKey), here) +
                        "; give another folder, or the options that it was begun with");
        }
    }
    size_ = static_cast<long long>(begin);
    const std::string head = std::string("{\"") + kHeaderKey;
    const bool is_ours = text.rfind(head, 0) == 0 || head.rfind(text, 0) == 0;  // even the first line may be torn
    if (begin < text.size() && number == 0 && !is_ours) {
        throw Error(file_.string() + " is not the journal of a study: give another folder");
    }
    // What follows the last line feed was cut off by a kill.
    if (begin < text.size() && ::ftruncate(descriptor_, size_) != 0) throw failure(file_, "cannot be written");
    if (number == 0) write_line(std::string("{\"") + kHeaderKey + "\":" + config + "}");
}

void StudyJournal::take_line(const std::string& line, std::size_t number) {
    const std::string where = file_.string() + ", line " + std::to_string(number);
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

void StudyJournal::write_line(const std::string& line) {
    const std::string bytes = line + "\n";
    for (std::size_t done = 0; done < bytes.size();) {
        const ssize_t count = ::pwrite(descriptor_, bytes.data() + done, bytes.size() - done, size_ + done);
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) {
            const Error problem = failure(file_, "cannot be written");
            if (::ftruncate(descriptor_, size_) != 0) throw problem;  // then the torn line is dropped on opening
            throw problem;
        }
        done += static_cast<std::size_t>(count);
    }
    if (::fdatasync(descriptor_) != 0) throw failure(file_, "cannot be brought to the disk");
    size_ += static_cast<long long>(bytes.size());
}

void StudyJournal::append(const TrialRecord& record) {
    if (trials_.contains(record.trial)) {
        throw Error("trial " + std::to_string(record.trial) + " is in " + file_.string() + " already");
    }
    write_line(trial_line(record));
    trials_.emplace(record.trial, record);
}

void StudyJournal::note_run(const std::string& run) {
    write_line("{\"run\":" + run + "}");
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

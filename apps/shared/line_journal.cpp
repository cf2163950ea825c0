#include "apps/shared/line_journal.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <nlohmann/json.hpp>
#include <system_error>

#include "apps/shared/json_text.h"
#include "core/base/error.h"

namespace raylign::detail::apps {
namespace {

using AnyOrder = nlohmann::json;  // the order of keys says nothing when settings are compared

Error journal_failure(const std::filesystem::path& file, const std::string& what) {
    return Error(file.string() + " " + what + ": " + std::generic_category().message(errno));
}

std::string read_all(int descriptor, const std::filesystem::path& file) {
    std::string text;
    std::vector<char> block(1 << 16);
    for (;;) {
        const ssize_t count = ::read(descriptor, block.data(), block.size());
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) throw journal_failure(file, "cannot be read");
        if (count == 0) return text;
        text.append(block.data(), static_cast<std::size_t>(count));
    }
}

Error no_journal(const std::filesystem::path& file, const JournalKind& kind) {
    return Error(file.string() + " is not the journal of a " + kind.what + ": give another folder");
}

AnyOrder header_of(const std::string& line, const std::filesystem::path& file, const JournalKind& kind) {
    try {
        const Json header = json_of_line(line);
        if (header.is_object() && header.contains(kind.key)) return AnyOrder(header).at(kind.key);
    } catch (const Error&) {  // it may be anything
    }
    throw no_journal(file, kind);
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

LineJournal::LineJournal(const std::filesystem::path& file, const std::string& config, JournalKind kind)
    : file_(file), kind_(std::move(kind)) {
    std::error_code ignored;
    std::filesystem::create_directories(file.parent_path(), ignored);  // a failure shows on opening
    try {
        open();
        read(config);
    } catch (...) {
        if (descriptor_ >= 0) ::close(descriptor_);
        throw;
    }
}

LineJournal::~LineJournal() { ::close(descriptor_); }

void LineJournal::open() {
    descriptor_ = ::open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NONBLOCK, 0666);
    if (descriptor_ < 0) throw journal_failure(file_, "cannot be written");
    struct stat status {};
    if (::fstat(descriptor_, &status) != 0) throw journal_failure(file_, "cannot be read");
    if (!S_ISREG(status.st_mode)) throw Error(file_.string() + " is no regular file: give another folder");
    if (::flock(descriptor_, LOCK_EX | LOCK_NB) == 0) return;
    if (errno == EWOULDBLOCK) throw Error(file_.string() + ": another run is working on this " + kind_.what);
    // Some network file systems know no locks: better to work without than not at all.
}

void LineJournal::set_aside() {
    std::error_code failed;
    std::filesystem::rename(file_, file_.string() + ".old", failed);
    if (failed) throw Error(file_.string() + " cannot be renamed: " + failed.message());
    ::close(descriptor_);
    lines_.clear();
    open();
}

void LineJournal::read(const std::string& config) {
    const std::string text = read_all(descriptor_, file_);
    std::size_t number = 0, begin = 0;
    for (std::size_t end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
        const std::string line = text.substr(begin, end - begin);
        if (++number > 1) {
            lines_.push_back(line);
            continue;
        }
        const AnyOrder there = header_of(line, file_, kind_), here = AnyOrder::parse(config);
        if (there == here) continue;
        if (kind_.other == JournalKind::Other::set_aside) {
            set_aside();
            append("{\"" + kind_.key + "\":" + config + "}");
            return;
        }
        throw Error(file_.string() + " belongs to another " + kind_.what + ": " + difference(there, here) +
                    "; give another folder, or the options that it was begun with");
    }
    size_ = static_cast<long long>(begin);
    const std::string head = "{\"" + kind_.key;
    const bool is_ours = text.rfind(head, 0) == 0 || head.rfind(text, 0) == 0;  // even the first line may be torn
    if (begin < text.size() && number == 0 && !is_ours) throw no_journal(file_, kind_);
    // What follows the last line feed was cut off by a kill.
    if (begin < text.size() && ::ftruncate(descriptor_, size_) != 0) throw journal_failure(file_, "cannot be written");
    if (number == 0) append(head + "\":" + config + "}");
}

std::string LineJournal::place_of(std::size_t line) const {
    return file_.string() + ", line " + std::to_string(line + 2);
}

void LineJournal::append(const std::string& line) {
    const std::string bytes = line + "\n";
    for (std::size_t done = 0; done < bytes.size();) {
        const ssize_t count =
            ::pwrite(descriptor_, bytes.data() + done, bytes.size() - done, size_ + static_cast<long long>(done));
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) {
            const Error problem = journal_failure(file_, "cannot be written");
            if (::ftruncate(descriptor_, size_) != 0) throw problem;  // then the torn line is dropped on opening
            throw problem;
        }
        done += static_cast<std::size_t>(count);
    }
    if (::fdatasync(descriptor_) != 0) throw journal_failure(file_, "cannot be brought to the disk");
    size_ += static_cast<long long>(bytes.size());
}

}  // namespace raylign::detail::apps

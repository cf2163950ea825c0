#include "core/io/files/temporary_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <csignal>
#include <string_view>
#include <system_error>
#include <vector>

#include "core/base/error.h"
#include "core/io/files/text.h"

namespace raylign::detail {

namespace {

constexpr std::string_view kTemporary = ".raylign-";  // then the process id, '-' and the target's name

/// Whether a file of this name was written by a process that is gone.
bool is_of_dead_process(std::string_view name) {
    if (!name.starts_with(kTemporary)) return false;
    pid_t process = 0;
    const auto [end, failure] = std::from_chars(name.data() + kTemporary.size(), name.data() + name.size(), process);
    if (failure != std::errc{} || process <= 0 || end == name.data() + name.size() || *end != '-') return false;
    return ::kill(process, 0) != 0 && errno == ESRCH;
}

bool is_unlocked_and_ours(const std::filesystem::path& path) {
    const Descriptor file(::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
    struct stat status {};
    if (!file.is_open() || ::fstat(file.number(), &status) != 0) return false;
    return S_ISREG(status.st_mode) && status.st_uid == ::geteuid() && ::flock(file.number(), LOCK_EX | LOCK_NB) == 0;
}

}  // namespace

void remove_dead_files(const std::filesystem::path& folder) {
    std::error_code ignored;
    std::vector<std::filesystem::path> dead;
    for (std::filesystem::directory_iterator entry(folder, ignored), end; !ignored && entry != end;
         entry.increment(ignored)) {
        if (is_of_dead_process(entry->path().filename().string())) dead.push_back(entry->path());
    }
    for (const std::filesystem::path& file : dead) {
        if (is_unlocked_and_ours(file)) std::filesystem::remove(file, ignored);
    }
}

std::string system_reason(int error_number) { return std::generic_category().message(error_number); }

TemporaryFile::TemporaryFile(const std::filesystem::path& target) : target_(target) {
    if (std::filesystem::is_directory(target)) throw Error(target.string() + " cannot be written: it is a folder");
    const std::filesystem::path folder = target.parent_path();
    if (!folder.empty() && !std::filesystem::is_directory(folder)) {
        throw Error(target.string() + " cannot be written: there is no folder " + folder.string());
    }
    // The process id keeps two runs that write the same file apart.
    // Lower case: ITK knows .mha and not .MHA.
    path_ =
        folder / (std::string(kTemporary) + std::to_string(::getpid()) + "-" + lower_case(target.filename().string()));
    remove_dead_files(folder.empty() ? "." : folder);
    // Locked for machines that share the folder and not the process ids.
    lock_ = Descriptor(::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666));
    if (lock_.is_open()) ::flock(lock_.number(), LOCK_SH | LOCK_NB);
}

TemporaryFile::~TemporaryFile() {
    std::error_code ignored;
    if (!committed_) std::filesystem::remove(path_, ignored);
}

void TemporaryFile::reserve(std::size_t bytes) const {
    constexpr std::size_t kHeaderBytes = 65536;
    const int file = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
    if (file < 0) throw Error(target_.string() + " cannot be written: " + system_reason(errno));
    const int failure = ::posix_fallocate(file, 0, static_cast<off_t>(bytes + kHeaderBytes));
    ::close(file);
    // EINVAL, EOPNOTSUPP: the file system cannot tell; the writer and the read-back must.
    if (failure != 0 && failure != EINVAL && failure != EOPNOTSUPP) {
        throw Error(target_.string() + " cannot be written: " + system_reason(failure));
    }
}

void TemporaryFile::commit() {
    std::error_code failure;
    std::filesystem::rename(path_, target_, failure);
    if (failure) throw Error(target_.string() + " cannot be written: " + failure.message());
    committed_ = true;
}

}  // namespace raylign::detail

#include "core/io/files/regular_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "core/base/error.h"
#include "core/io/files/temporary_file.h"

namespace raylign::detail {
namespace {

Error unreadable(const std::filesystem::path& path, int error_number) {
    if (error_number == ENOENT) return Error(path.string() + " does not exist");
    return Error(path.string() + " cannot be read: " + system_reason(error_number));
}

void check_is_regular(const struct stat& status, const std::filesystem::path& path) {
    if (S_ISREG(status.st_mode)) return;
    const char* what = S_ISDIR(status.st_mode)    ? "folder"
                       : S_ISFIFO(status.st_mode) ? "FIFO (a pipe)"
                       : S_ISSOCK(status.st_mode) ? "socket"
                                                  : "device";
    throw Error(path.string() + " is a " + what + ": must be a file");
}

}  // namespace

Descriptor open_regular_file(const std::filesystem::path& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0) throw unreadable(path, errno);
    check_is_regular(status, path);  // opening some devices has effects
    Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
    if (!file.is_open()) throw unreadable(path, errno);
    if (::fstat(file.number(), &status) != 0) throw unreadable(path, errno);
    check_is_regular(status, path);
    return file;
}

std::string regular_file_bytes(const std::filesystem::path& path) {
    constexpr std::size_t kSmallest = 4096, kLargest = 1 << 20;  // of a piece, bytes
    const Descriptor file = open_regular_file(path);
    struct stat status {};
    if (::fstat(file.number(), &status) != 0) throw unreadable(path, errno);
    // The size is a hint: /proc has files of no size, and a file may grow. A megabyte at once for a small file costs
    // more than reading it.
    const auto size = static_cast<std::size_t>(status.st_size);
    std::string bytes;
    for (std::size_t done = 0;;) {
        const std::size_t piece = std::clamp(size - std::min(done, size) + 1, kSmallest, kLargest);
        bytes.resize(done + piece);
        const ssize_t count = ::read(file.number(), bytes.data() + done, piece);
        if (count < 0 && errno != EINTR) throw unreadable(path, errno);
        done += count > 0 ? static_cast<std::size_t>(count) : 0;
        bytes.resize(done);
        if (count == 0) return bytes;
    }
}

}  // namespace raylign::detail

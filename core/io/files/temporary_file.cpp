#include "core/io/files/temporary_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "core/base/error.h"
#include "core/io/files/text.h"

namespace raylign::detail {

std::string system_reason(int error_number) { return std::generic_category().message(error_number); }

TemporaryFile::TemporaryFile(const std::filesystem::path& target) : target_(target) {
    if (std::filesystem::is_directory(target)) throw Error(target.string() + " cannot be written: it is a folder");
    const std::filesystem::path folder = target.parent_path();
    if (!folder.empty() && !std::filesystem::is_directory(folder)) {
        throw Error(target.string() + " cannot be written: there is no folder " + folder.string());
    }
    // The process id keeps two runs that write the same file apart.
    // Lower case: ITK knows .mha and not .MHA.
    path_ = folder / (".raylign-" + std::to_string(::getpid()) + "-" + lower_case(target.filename().string()));
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

#include "core/io/temporary_file.h"

#include <unistd.h>

#include <system_error>

#include "core/error.h"

namespace raylign::detail {

std::string system_reason(int error_number) { return std::generic_category().message(error_number); }

TemporaryFile::TemporaryFile(const std::filesystem::path& target) : target_(target) {
    if (std::filesystem::is_directory(target)) throw Error(target.string() + " cannot be written: it is a folder");
    const std::filesystem::path folder = target.parent_path();
    if (!folder.empty() && !std::filesystem::is_directory(folder)) {
        throw Error(target.string() + " cannot be written: there is no folder " + folder.string());
    }
    // The process id keeps two runs that write the same file apart.
    path_ = folder / (".raylign-" + std::to_string(::getpid()) + "-" + target.filename().string());
}

TemporaryFile::~TemporaryFile() {
    std::error_code ignored;
    if (!committed_) std::filesystem::remove(path_, ignored);
}

void TemporaryFile::commit() {
    std::error_code failure;
    std::filesystem::rename(path_, target_, failure);
    if (failure) throw Error(target_.string() + " cannot be written: " + failure.message());
    committed_ = true;
}

}  // namespace raylign::detail

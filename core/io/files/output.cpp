#include "core/io/files/output.h"

#include <fcntl.h>
#include <openssl/evp.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <memory>
#include <system_error>
#include <tuple>

#include "core/base/error.h"
#include "core/io/files/regular_file.h"
#include "core/io/files/temporary_file.h"

namespace raylign::detail {
namespace {

namespace fs = std::filesystem;

Error not_writable(const fs::path& path, const std::string& reason) {
    return Error("output " + path.string() + " cannot be written: " + reason);
}

Error not_makeable(const fs::path& folder, const std::string& reason) {
    return Error("cannot make the folder " + folder.string() + ": " + reason);
}

/// Throws where something that is no folder has this name.
bool is_folder(const fs::path& path, const fs::path& wanted) {
    std::error_code failure, no_link;
    const fs::file_status status = fs::status(path, failure);
    if (fs::is_directory(status)) return true;
    if (status.type() == fs::file_type::not_found) {
        if (!fs::is_symlink(fs::symlink_status(path, no_link))) return false;
        const std::string what = path.string() + " is a symbolic link to ";
        throw not_makeable(wanted, what + fs::read_symlink(path, no_link).string() + ", which does not exist");
    }
    if (failure) throw not_makeable(wanted, failure.message());
    throw not_makeable(wanted, path.string() + " is not a folder");
}

/// The folders of `folder` that do not exist yet, outermost first.
std::vector<fs::path> missing_folders(const fs::path& wanted) {
    std::vector<fs::path> missing;
    for (fs::path folder = wanted; !folder.empty() && !is_folder(folder, wanted); folder = folder.parent_path()) {
        missing.push_back(folder);
    }
    std::reverse(missing.begin(), missing.end());
    return missing;
}

constexpr std::string_view kStaging = ".raylign-staging-";

fs::path make_staging(const fs::path& folder) {
    std::string name = (folder / (std::string(kStaging) + "XXXXXX")).string();
    if (::mkdtemp(name.data()) == nullptr) throw not_writable(folder, system_reason(errno));
    return name;
}

/// Opens a folder and locks it for as long as it is open; closed where it is not there, or locked already.
Descriptor locked_folder(const fs::path& folder) {
    Descriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW));
    if (opened.is_open() && ::flock(opened.number(), LOCK_EX | LOCK_NB) != 0) return {};
    return opened;
}

/// A staging folder and its lock. Another run may take it for a dead one's before it is locked: then the next is tried.
/// Where the file system knows no locks it stays unlocked, and nobody removes it.
std::pair<fs::path, Descriptor> make_locked_staging(const fs::path& folder) {
    constexpr int kTries = 100;
    for (int i = 0; i < kTries; ++i) {
        const fs::path staging = make_staging(folder);
        Descriptor lock = locked_folder(staging);
        if (fs::exists(staging)) return {staging, std::move(lock)};
    }
    throw not_writable(folder, "other runs remove what this one makes there");
}

/// Removes the staging folders that killed runs of this user left. That of a run at work is locked.
void remove_dead_staging(const fs::path& folder) {
    std::error_code ignored;
    std::vector<fs::path> dead;
    for (fs::directory_iterator entry(folder, ignored), end; !ignored && entry != end; entry.increment(ignored)) {
        if (entry->path().filename().string().starts_with(kStaging)) dead.push_back(entry->path());
    }
    for (const fs::path& staging : dead) {
        const Descriptor lock = locked_folder(staging);
        struct stat status {};
        if (!lock.is_open() || ::fstat(lock.number(), &status) != 0 || status.st_uid != ::geteuid()) continue;
        fs::remove_all(staging, ignored);
    }
}

void write_all(const fs::path& path, std::string_view text) {
    const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (file < 0) throw not_writable(path, system_reason(errno));
    int failure = 0;
    while (!text.empty() && failure == 0) {
        const ssize_t written = ::write(file, text.data(), text.size());
        if (written >= 0) {
            text.remove_prefix(static_cast<std::size_t>(written));
        } else if (errno != EINTR) {
            failure = errno;
        }
    }
    if (::close(file) != 0 && failure == 0) failure = errno;  // network folders report a full disk here
    if (failure != 0) throw not_writable(path, system_reason(failure));
}

/// One file of a commit: a hard link keeps the older file reachable until all are in place.
struct Replacement {
    fs::path target, older;
    bool has_older = false;
};

void undo(const std::vector<Replacement>& done) {
    std::error_code ignored;
    for (auto it = done.rbegin(); it != done.rend(); ++it) {
        if (it->has_older) {
            fs::rename(it->older, it->target, ignored);
        } else {
            fs::remove(it->target, ignored);
        }
    }
}

}  // namespace

OutputFolder::OutputFolder(const fs::path& folder) : folder_(fs::absolute(folder).lexically_normal()) {
    if (!folder_.has_filename()) folder_ = folder_.parent_path();  // "out/" names the folder "out"
    std::error_code failure;
    const std::vector<fs::path> missing = missing_folders(folder_);
    try {
        for (const fs::path& path : missing) {
            fs::create_directory(path, failure);
            if (failure) throw not_makeable(folder_, failure.message());
            made_folders_.push_back(path);
        }
        remove_dead_staging(folder_);
        remove_dead_files(folder_);
        std::tie(staging_, lock_) = make_locked_staging(folder_);
    } catch (...) {
        remove_made_folders();
        throw;
    }
}

OutputFolder::~OutputFolder() {
    std::error_code ignored;
    fs::remove_all(staging_, ignored);
    if (!committed_) remove_made_folders();
}

void OutputFolder::remove_made_folders() noexcept {
    std::error_code ignored;
    for (auto it = made_folders_.rbegin(); it != made_folders_.rend(); ++it) fs::remove(*it, ignored);  // only if empty
}

fs::path OutputFolder::stage(std::string_view name) {
    const fs::path path(name);
    if (path.empty() || path.filename() != path || name == "." || name == "..") {
        throw bad_value("output name", name, "a plain file name", folder_.string());
    }
    if (std::find(names_.begin(), names_.end(), name) == names_.end()) names_.emplace_back(name);
    return staging_ / path;
}

void OutputFolder::commit() {
    std::error_code failure;
    for (const std::string& name : names_) {  // everything that can be known beforehand
        if (fs::is_directory(folder_ / name, failure)) throw not_writable(folder_ / name, "a folder has this name");
        if (!fs::exists(staging_ / name)) throw Error("output " + name + " was announced and never written");
    }
    const fs::path kept = make_staging(staging_);
    std::vector<Replacement> done;
    for (const std::string& name : names_) {
        Replacement one{folder_ / name, kept / name};
        if (fs::exists(one.target, failure)) {
            // Where the file system has no hard links the older file cannot be brought back; the rename itself stays
            // atomic.
            fs::create_hard_link(one.target, one.older, failure);
            one.has_older = !failure;
        }
        fs::rename(staging_ / name, one.target, failure);
        if (failure) {
            undo(done);
            throw not_writable(one.target, failure.message());
        }
        done.push_back(one);
    }
    committed_ = true;
}

void write_text(const fs::path& path, std::string_view text) {
    TemporaryFile temporary(path);
    write_all(temporary.path(), text);
    temporary.commit();
}

std::string sha256_of_file(const fs::path& path) {
    const Descriptor file = open_regular_file(path);
    const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> hash(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
    EVP_DigestInit_ex(hash.get(), EVP_sha256(), nullptr);
    std::vector<char> block(1 << 20);
    for (ssize_t count; (count = ::read(file.number(), block.data(), block.size())) != 0;) {
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) throw Error(path.string() + " cannot be read to its end: " + system_reason(errno));
        EVP_DigestUpdate(hash.get(), block.data(), static_cast<std::size_t>(count));
    }
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest;
    unsigned int length = 0;
    EVP_DigestFinal_ex(hash.get(), digest.data(), &length);
    std::string hex;
    for (unsigned int i = 0; i < length; ++i) {
        hex += "0123456789abcdef"[digest[i] >> 4];
        hex += "0123456789abcdef"[digest[i] & 15];
    }
    return hex;
}

}  // namespace raylign::detail

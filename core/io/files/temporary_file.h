#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "core/io/decode/packets.h"

namespace raylign::detail {

/// The system's words for an errno value, e.g. "No space left on device".
[[nodiscard]] std::string system_reason(int error_number);

/// Removes the temporary files that killed runs of this user left in `folder`: their process is gone, and no process of
/// another machine has them locked.
void remove_dead_files(const std::filesystem::path& folder);

/// A hidden name beside `target` with the same extension in lower case (formats are told by it). What was written there
/// replaces `target` by commit(); without commit it is removed, and `target` stays as it was. What a killed run left
/// there is removed by the next.
class TemporaryFile {
public:
    explicit TemporaryFile(const std::filesystem::path& target);
    ~TemporaryFile();
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;

    [[nodiscard]] const std::filesystem::path& path() const { return path_; }
    /// Takes room for `bytes` of data and some header, so that a full disk is found here, with the system's reason, and
    /// not by a writer that prints or says nothing. Writers that truncate the file give the room back and take it
    /// again.
    void reserve(std::size_t bytes) const;
    /// Throws Error with the system's reason where the target cannot be replaced.
    void commit();

private:
    std::filesystem::path target_, path_;
    Descriptor lock_;  ///< of the file; none where it could not be made yet: its writer will say why
    bool committed_ = false;
};

}  // namespace raylign::detail

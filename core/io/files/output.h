#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/io/decode/packets.h"

namespace raylign::detail {

/// Files of one run, staged in a hidden folder inside the output folder and moved into place together by commit().
/// Destroyed without commit (an error, Ctrl-C) it removes the staging folder: nothing old is lost, nothing half
/// written. What a killed run left there is removed by the next: the staging folder of a run at work is locked.
class OutputFolder {
public:
    /// Makes `folder` if missing. Throws Error where it cannot be made or written (named, with the system's reason).
    explicit OutputFolder(const std::filesystem::path& folder);
    ~OutputFolder();
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;

    /// Where to write `name` (a plain file name) before commit.
    [[nodiscard]] std::filesystem::path stage(std::string_view name);
    /// Moves every staged file to its name in the folder, replacing older ones. Throws Error, with the older files back
    /// in place, where one cannot be moved or was never written.
    void commit();

private:
    void remove_made_folders() noexcept;

    std::filesystem::path folder_, staging_;
    Descriptor lock_;  ///< of the staging folder
    std::vector<std::string> names_;
    std::vector<std::filesystem::path> made_folders_;  ///< outermost first; removed again if the run leaves them empty
    bool committed_ = false;
};

/// Writes a text file through a temporary name in the same folder. Throws Error with the system's reason.
void write_text(const std::filesystem::path& path, std::string_view text);

/// SHA-256 of a file's bytes, lower-case hex.
[[nodiscard]] std::string sha256_of_file(const std::filesystem::path& path);

}  // namespace raylign::detail

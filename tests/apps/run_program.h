#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tests/support/test_folder.h"

namespace raylign::detail::test {

struct ProgramResult {
    int exit_code = -1;  ///< 128 + signal where a signal ended it
    std::string out, err;
};

/// Runs the built program `raylign` with these arguments and waits. Neither stdout nor stderr is a terminal.
[[nodiscard]] ProgramResult run_raylign(const std::vector<std::string>& arguments);

/// The same, but sends it `signal` once `ready_file_in` holds an entry whose name starts with '.' (the staging folder:
/// the run is under way).
[[nodiscard]] ProgramResult run_raylign_and_signal(const std::vector<std::string>& arguments, int signal,
                                                   const std::filesystem::path& ready_file_in);

/// The same, but calls `then` with its process once `is_ready` says so.
[[nodiscard]] ProgramResult run_raylign_and(const std::vector<std::string>& arguments,
                                            const std::function<bool()>& is_ready,
                                            const std::function<void(int process)>& then);

/// The same with standard output closed, or a pipe that nobody reads.
enum class DeadOutput { closed, broken_pipe };
[[nodiscard]] ProgramResult run_raylign_unheard(const std::vector<std::string>& arguments, DeadOutput output);

/// The same, where no file may grow beyond `bytes`: writes fail as they do on a full disk.
[[nodiscard]] ProgramResult run_raylign_on_full_disk(const std::vector<std::string>& arguments, std::size_t bytes);

[[nodiscard]] std::string read_text(const std::filesystem::path& path);
void write_text_file(const std::filesystem::path& path, const std::string& text);

/// Names in a folder, sorted.
[[nodiscard]] std::vector<std::string> names_in(const std::filesystem::path& folder);

}  // namespace raylign::detail::test

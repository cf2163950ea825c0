#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace raylign::detail::gl {

/// A linked program in the driver's own form.
struct ProgramBinary {
    unsigned format = 0;
    std::vector<char> bytes;
};

/// Everything that a binary depends on: the driver's names and version, and the shaders' text.
using ProgramIdentity = std::string;

/// Where programs are kept from run to run: "raylign/programs" in XDG_CACHE_HOME or ~/.cache, or what the environment's
/// RAYLIGN_PROGRAM_FOLDER says; empty (nothing is kept) where that is empty or there is no home.
[[nodiscard]] std::filesystem::path default_program_folder();

/// The binary that was kept under this identity; none where the file is missing, damaged or another's.
[[nodiscard]] std::optional<ProgramBinary> read_program(const std::filesystem::path& folder,
                                                        const ProgramIdentity& identity);

/// Keeps it for the next run. Whatever prevents that (a read-only or full disk) is no error: the next run compiles.
void keep_program(const std::filesystem::path& folder, const ProgramIdentity& identity, const ProgramBinary& binary);

}  // namespace raylign::detail::gl

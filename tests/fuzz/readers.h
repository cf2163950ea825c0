#pragma once

#include <filesystem>
#include <span>
#include <string_view>

namespace raylign::detail::test {

/// A reader of foreign files, as the fuzzer calls it.
struct FuzzedReader {
    std::string_view name;       ///< its corpus: tests/fuzz/corpus/<name>
    std::string_view extension;  ///< formats are told by it
    /// Reads the file, and throws std::logic_error where what was read cannot be used: a pose that is none, a voxel
    /// that is not finite. Whatever it throws besides Error is a finding.
    void (*read)(const std::filesystem::path& path);
};

[[nodiscard]] std::span<const FuzzedReader> fuzzed_readers();

}  // namespace raylign::detail::test

#pragma once

#include <string>

namespace raylign::detail::apps {

// Of a source that CMake makes when it configures, so that a commit recompiles one small file.

/// Of the sources, short; "unknown" where they did not lie in a git repository.
[[nodiscard]] const char* build_commit() noexcept;

/// What was built in, and the compiler: "cpu, gl, mpi, g++ 12.2".
[[nodiscard]] const char* build_options() noexcept;

/// "raylign 0.2.0 (commit abc1234, cpu, gl, mpi, g++ 12.2)".
[[nodiscard]] std::string version_line();

}  // namespace raylign::detail::apps

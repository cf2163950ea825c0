#pragma once

#include <string>
#include <vector>

namespace raylign::detail::apps {

/// What every sub-command gets besides its own options.
struct Invocation {
    std::string command_line;  ///< quoted for a shell: repeats the run
};

/// The arguments joined by blanks, quoted for a POSIX shell where needed.
[[nodiscard]] std::string quote_for_shell(const std::vector<std::string>& arguments);

}  // namespace raylign::detail::apps

#pragma once

#include <functional>
#include <string>

#include "apps/shared/help.h"

namespace raylign::detail::apps {

/// "raylign NAME" and those of a command's options that were given and that `keeps` keeps, with their values, quoted
/// for a shell.
[[nodiscard]] std::string repeated(const std::string& name, const CLI::App& command,
                                   const std::function<bool(const CLI::Option&)>& keeps);

}  // namespace raylign::detail::apps

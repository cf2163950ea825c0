#pragma once

#include "apps/shared/help.h"

namespace raylign::detail::apps {

/// Flags of `register` that `track` has, too.
void add_auto_mask_flag(CLI::App& command, RegisterOptions& options);
void add_method_flags(CLI::App& command, RegisterOptions& options);
void add_search_flags(CLI::App& command, RegisterOptions& options);

}  // namespace raylign::detail::apps

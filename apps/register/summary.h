#pragma once

#include <string>

#include "apps/register/report.h"

namespace raylign::detail::apps {

/// What `register` tells on stdout: verdict, how the object moved, cost, errors against the truth, time, files.
[[nodiscard]] std::string register_summary(const RegisterRun& run);

}  // namespace raylign::detail::apps

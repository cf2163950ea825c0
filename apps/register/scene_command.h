#pragma once

#include "apps/register/options.h"
#include "apps/shared/invocation.h"

namespace raylign::detail::apps {

/// `register` with several objects: exit code 0 where all are ok, else 1.
int run_register_scene(const RegisterOptions& options, const Invocation& invocation);

}  // namespace raylign::detail::apps

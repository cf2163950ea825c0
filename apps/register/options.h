#pragma once

#include "apps/shared/flags.h"

namespace raylign::detail::apps {

/// What the command line of `register` says.
struct RegisterOptions {
    VolumeFlags volume;
    ViewFlags views;
    StartFlags start;
    TruthFlags truth;
    MethodFlags method;
    SearchFlags search;
    BackendFlags backend;
    OutputFlags output;
};

}  // namespace raylign::detail::apps

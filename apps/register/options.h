#pragma once

#include "apps/shared/flags.h"

namespace raylign::detail::apps {

struct RefineFlags {
    bool refine_views = false;
    std::string prior;      ///< "DEG,MM"; "" = the default
    std::string kept_view;  ///< name, or none; "" = the first
};

/// What the command line of `register` says.
struct RegisterOptions {
    VolumeFlags volume;
    ViewFlags views;
    StartFlags start;
    TruthFlags truth;
    MethodFlags method;
    SearchFlags search;
    RefineFlags refine;
    BackendFlags backend;
    OutputFlags output;
};

}  // namespace raylign::detail::apps

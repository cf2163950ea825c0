#pragma once

#include <filesystem>
#include <string>

#include "apps/objects/object_options.h"
#include "apps/shared/flags.h"
#include "apps/viewer/viewer_page.h"

namespace raylign::detail::apps {

struct RefineFlags {
    bool refine_views = false;
    std::string prior;      ///< "DEG,MM"; "" = the default
    std::string kept_view;  ///< name, or none; "" = the first
};

/// What the command line of `register` says.
struct RegisterOptions : ObjectOptions {
    MethodFlags method;
    SearchFlags search;
    RefineFlags refine;
    BackendFlags backend;
    OutputFlags output;
    std::filesystem::path dicom_out;  ///< folder for DICOM pictures; "" = none
    bool no_viewer = false;
    GoOn go_on;  ///< this command again, from another start
};

}  // namespace raylign::detail::apps

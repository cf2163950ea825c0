#pragma once

#include <string>
#include <vector>

#include "apps/shared/flags.h"

namespace raylign::detail::apps {

struct RefineFlags {
    bool refine_views = false;
    std::string prior;      ///< "DEG,MM"; "" = the default
    std::string kept_view;  ///< name, or none; "" = the first
};

/// Several objects at once.
struct SceneFlags {
    std::vector<std::string> objects;         ///< names or numbers of labels, "all-bones", or one box for --object
    std::vector<std::string> bones;           ///< NAME=FILE or NAME=LABELS
    std::vector<std::string> starts, truths;  ///< FILE or NAME=FILE
    bool segment_bones = false;               ///< no label map: the CT's connected bones are the labels
    std::string rest;                         ///< body, still or none; "" = none
    std::vector<std::string> joints;          ///< PROXIMAL,DISTAL or PROXIMAL,DISTAL=MM,DEG
    std::string cardan;                       ///< "" = XYZ
};

/// What the command line of `register` says.
struct RegisterOptions {
    SceneFlags scene;
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

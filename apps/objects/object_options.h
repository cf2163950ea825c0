#pragma once

#include <string>
#include <vector>

#include "apps/shared/flags.h"

namespace raylign::detail::apps {

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

/// What command lines say of objects, views and starts.
struct ObjectOptions {
    SceneFlags scene;
    VolumeFlags volume;
    ViewFlags views;
    StartFlags start;
    TruthFlags truth;
};

/// --object, --bone, --segment-bones, --rest and --start: what serves one object and several takes the place of what
/// the shared flags have for one.
void add_several_objects_flags(CLI::App& command, SceneFlags& flags);

}  // namespace raylign::detail::apps

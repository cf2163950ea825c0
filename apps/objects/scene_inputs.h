#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/objects/object_options.h"
#include "apps/objects/scene_asked.h"
#include "apps/shared/manifest.h"
#include "core/registration/scene/scene.h"
#include "raylign/io/views.h"
#include "raylign/view.h"
#include "raylign/volume.h"

namespace raylign::detail::apps {

/// One object as `register` and `place` read it.
struct SceneInput {
    std::string name;
    Volume volume;
    RigidTransform start_world_from_ct;
    Mobility mobility = Mobility::moves;
    bool is_rest = false;
    std::optional<RigidTransform> true_world_from_ct;
    std::vector<Eigen::Vector3d> targets_ct_mm;  ///< where the true pose is known
};

/// Everything that is read of several objects.
struct SceneInputs {
    std::vector<SceneInput> objects;
    std::vector<View> views;
    std::vector<ViewOrigin> origins;  ///< of the views
    std::vector<AskedJoint> joints;
    std::vector<JointLimit> limits;  ///< of those joints that have one, in order
    std::optional<BoneSplit> split;  ///< of --segment-bones
    std::vector<std::string> notes;
    std::vector<std::filesystem::path> files;  ///< every file read
    InputHashes hashes;
    double load_s = 0;
};

/// True where the command line names objects: --bone, or --object with anything but a box.
[[nodiscard]] bool is_scene(const ObjectOptions& options);

/// Moves what the flags that serve one object and several say to where one object has it. Throws Error for --start or
/// --truth of several, and for --rest and --joint without objects.
void settle_one_object(ObjectOptions& options);

/// Reads the files, the small ones first. Throws Error for flags that contradict each other, names that stand twice or
/// are unknown, and what cut_objects refuses; also where two files hold the same bone.
[[nodiscard]] SceneInputs read_scene_inputs(const ObjectOptions& options, ReadImages images = ReadImages::required);

}  // namespace raylign::detail::apps

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "raylign/view.h"
#include "raylign/volume.h"

namespace raylign::detail::bench {

/// What all scenes of a run share.
struct SceneSettings {
    int views = 2, pixels = 256;
    std::string xray = "ideal";   ///< name of an X-ray model
    double angle_deg = 90;        ///< between the two views
    double field_mm = 400;        ///< of a view at the isocentre; of a part 3/4 of it
    std::optional<Volume> other;  ///< the CT that scene `other` X-rays
    int pose = 0;                 ///< 0: as ever; 1, 2, ...: each another pose of the object, and other noise
};

struct Scene {
    std::string name;
    Volume moving;  ///< what is registered
    std::vector<View> views;
    std::vector<Eigen::Vector3d> targets;
    RigidTransform truth;
    double success_mm = 0;  ///< 0 = none: there is no right pose
};

/// Two rods with screws behind the thoracic spine, other contrast, and water where the CT shows lung.
void put_metal(Volume& actual);

/// Names in words, for errors and usage.
inline constexpr const char* kSceneNames =
    "clean, noise, scatter, metal, truncated, other, wrong-view-DEGREES, wrong-view-LENGTHmm, wrong-sdd-PERCENT, "
    "vertebra-1 to vertebra-5 "
    "or spine";

/// Throws Error for an unknown name, and for a scene that these settings do not suffice for.
[[nodiscard]] Scene make_scene(const std::string& name, const Volume& ct, const SceneSettings& settings);

}  // namespace raylign::detail::bench

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/registration/scene/scene.h"
#include "raylign/phantom.h"

namespace raylign::detail::bench {

/// What a run is about.
struct BonesSettings {
    int trials = 5, first = 0, views = 2, objects = 5;
    std::string rest = "none", hemipelves, chest, labels, xray = "ideal";
    std::vector<std::string> names;                                 ///< of the labels
    std::vector<double> joint;                                      ///< mm and degrees, of neighbours in order
    std::vector<double> body_mm{340, 220};                          ///< width and depth, of bones without a body
    double photons = 1e5, moved = 5, off_mm = 5, success_mm = 0.5;  ///< moved: mm and degrees, per component
    int halvings = 1;                                               ///< of a CT, before it is registered
    bool alone = false;
};

struct Bone {
    std::string name;
    Phantom solid;        ///< of the spine
    Volume fine, volume;  ///< of a CT: what X-rays are made of; what is registered
    std::vector<Eigen::Vector3d> targets;
};

/// Bones, and what there is beside them.
struct Body {
    Phantom whole;           ///< of the spine
    Volume fine_rest, rest;  ///< as with Bone; empty = nothing
    std::vector<Bone> bones;
    RigidTransform pose;    ///< of all, before anything moves
    double field_mm = 220;  ///< of a view at the isocentre
    int lone_view = 0;      ///< the one that stays where only one is wanted
    std::vector<JointLimit> joints;
};

/// The spine phantom; the halves of a pelvis; vertebra-2 and vertebra-3 of the chest CT, as boxes; or labels of a CT.
[[nodiscard]] Body make_body(const BonesSettings& settings);

struct BonesTrial {
    std::vector<RigidTransform> truth, starts;
};
/// Each bone is moved by its own motion, and starts between off_mm and twice as much from where it is then.
[[nodiscard]] BonesTrial make_trial(const Body& body, const BonesSettings& settings, int seed);

/// 256^2. Ideal: exact line integrals of the phantom's solids, or trilinear steps through the fine grids, and quantum
/// noise; else by an X-ray model, of the fine grids with the bones resampled where they are.
[[nodiscard]] std::vector<View> take_xrays(const Body& body, const std::vector<RigidTransform>& truth,
                                           const BonesSettings& settings, int seed, Backend& backend);

}  // namespace raylign::detail::bench

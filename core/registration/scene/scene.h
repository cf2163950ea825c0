#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/registration/object/resident_volume.h"
#include "core/registration/scene/joint_update.h"
#include "raylign/registration.h"

namespace raylign::detail {

/// What an object of a scene may do.
enum class Mobility {
    moves,  ///< has a pose of its own, which is sought and judged
    stays,  ///< is where its start says, and explains what it shows there
};

/// One of several rigid objects that X-rays show together. The volume is borrowed.
struct SceneObject {
    std::string name;
    const Volume& volume;
    RigidTransform start_world_from_ct;
    Mobility mobility = Mobility::moves;
    bool is_rest = false;  ///< what is left of the body: it is not sought for when lost, and gives no scale
};

/// What became of a scene.
struct SceneResult {
    /// Per object, in order: its pose, verdict and expected error, as of a part registered alone against what the
    /// others leave unexplained. Of an object that stays: its start, with nothing judged.
    std::vector<RegistrationResult> objects;
    std::vector<RigidTransform> together;     ///< per object: where all together ended
    double cost_initial = 0, cost_final = 0;  ///< of all together on the finest level, its weights at the end
    int iterations = 0;                       ///< of all together
    std::vector<JointOutcome> joints;         ///< one per limit
    std::vector<std::string> decisions;
    double together_s = 0;  ///< wall time of moving all together
    double total_s = 0;     ///< wall time of all
    bool ok = false;        ///< every object that moves is
};

/// Registers objects together: the DRR of a view is the sum of the objects' DRRs, each at its own pose. All poses are
/// moved at once by Levenberg-Marquardt (scene_level.h), coarse to fine, under weights that take out what no object
/// explains. Then each object is finished and judged alone, against the X-rays less the others (times the gain that
/// fits best), with a search near where it is unless nearly all is explained there: expected error and verdict are
/// those of a part. One that is doubtful then is sought for around its start against that remainder; where the scene
/// explains the X-rays better with what was found, all are moved together once more; where it does not, the object is
/// judged where all together ended. An object that cannot be judged (no view shows it) is doubtful and says why; the
/// others go on. `limits`: joints, which take part in every step
/// (joints.h) and in the poses and expected errors (joint_update.h). Throws Error for no objects that move, names that
/// stand twice, bad volumes and views, a method other than gauss-newton, options.refine_views, options out of range,
/// and limits that contradict each other: one object at both ends, or two that stay, two limits of the same objects,
/// and objects that are no neighbours.
[[nodiscard]] SceneResult register_scene(std::span<const SceneObject> objects, std::span<const View> views,
                                         const RegistrationOptions& options, Backend& backend,
                                         const RunControl& control = {}, std::span<const JointLimit> limits = {});

/// The same on volumes that stay resident, one per object and made of its volume.
[[nodiscard]] SceneResult register_resident_scene(std::span<const SceneObject> objects,
                                                  std::span<ResidentVolume* const> volumes, std::span<const View> views,
                                                  const RegistrationOptions& options, const RunControl& control = {},
                                                  std::span<const JointLimit> limits = {});

}  // namespace raylign::detail

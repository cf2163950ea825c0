#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/base/clock.h"
#include "core/registration/object/resident_volume.h"
#include "core/registration/scene/joints.h"
#include "core/registration/scene/remainder.h"
#include "core/registration/scene/scene_level.h"
#include "raylign/registration.h"

namespace raylign::detail {

/// What all steps of one scene share.
struct SceneDescent {
    SceneDescent(std::span<const View> seen, const RegistrationOptions& chosen, const RunControl& watched)
        : views(seen), options(chosen), control(watched) {}

    std::span<const View> views;
    const RegistrationOptions& options;
    const RunControl& control;
    std::vector<ResidentVolume*> volumes;                             ///< per object; borrowed
    std::vector<RigidTransform> starts_world_from_ct, world_from_ct;  ///< per object; the second: the best so far
    std::vector<std::size_t> moving, guides;  ///< those that move; those of them that say how coarse to begin
    bool has_rest = false;                    ///< what is left of the body is an object: no edge is foreign
    std::vector<JointPrior> joints, pulling;  ///< one per limit; those of them that take part in the steps
    Shown shown;                              ///< at these poses
    double cost_initial = 0, cost_final = 0;  ///< on the finest level
    int iterations = 0;
    std::optional<std::string> stopped_by;  ///< why it ended early
    Clock::time_point begin = Clock::now();
};

/// Moves all objects together, coarse to fine.
void descend_together(SceneDescent& scene);

/// Moves all objects together from poses that are right to about a millimetre, as predictions from frames before are:
/// one level, `coarser_by` above the finest as far as there are any, with a fine filter and the robust weights of
/// these poses. Draws nothing: of what is shown, gains alone. Where none moves they are all that is found.
void follow_together(SceneDescent& scene, int coarser_by);

/// The finest level once more, from the poses as they are.
void finish_together(SceneDescent& scene);

/// What object k shows at its pose now: others are judged against that.
void show_anew(SceneDescent& scene, std::size_t k);

/// Wall time since the scene began.
[[nodiscard]] double elapsed_s(const SceneDescent& scene);

/// Tells the caller how far the run is: a share in [0, 1].
void show_scene_progress(const SceneDescent& scene, double fraction);

/// Takes these poses, one per object, where the scene explains the X-rays better with them.
[[nodiscard]] bool try_poses(SceneDescent& scene, const std::vector<RigidTransform>& world_from_ct);

}  // namespace raylign::detail

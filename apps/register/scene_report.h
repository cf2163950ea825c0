#pragma once

#include <string>
#include <vector>

#include "apps/objects/scene_inputs.h"
#include "apps/report_page/report_page.h"
#include "apps/shared/invocation.h"
#include "core/registration/scene/collisions.h"
#include "raylign/backends.h"
#include "raylign/joint_motion.h"

namespace raylign::detail::apps {

/// One run of `register` with several objects, as the report and the summary tell it.
struct SceneRun {
    const RegisterOptions& options;
    const Invocation& invocation;
    const SceneInputs& inputs;
    BackendInfo backend;
    std::vector<BackendStatus> passed_over;
    SceneResult result;
    std::vector<Collision> collisions;  ///< of the objects at the poses found, what is left of the body aside
    std::vector<std::string> outputs;   ///< file names in the output folder
    double total_s = 0;
};

/// How one object lies to another: proximal_from_distal, with CT axes in both objects' centres.
struct SceneJoint {
    std::string proximal, distal;
    RigidTransform proximal_from_distal;
    Eigen::Vector3d angles_rad;  ///< Cardan angles, in the order of the sequence
    std::optional<JointLimit> limit;
    JointOutcome outcome;  ///< of the limit
};
[[nodiscard]] std::vector<SceneJoint> scene_joints(const SceneRun& run, const CardanSequence& sequence);

/// Why objects are doubtful, each with its name.
[[nodiscard]] std::vector<std::string> all_reasons(const SceneRun& run);

/// report.json, indented, with a final newline.
[[nodiscard]] std::string scene_json(const SceneRun& run);

/// What there is to know, for a terminal.
[[nodiscard]] std::string scene_summary(const SceneRun& run);

}  // namespace raylign::detail::apps

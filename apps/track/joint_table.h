#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/track/inputs.h"
#include "raylign/io/trajectory.h"

namespace raylign::detail::apps {

/// How a distal bone stands to a proximal one in one frame.
struct JointRow {
    int frame = 0;
    TrackStatus status = TrackStatus::missing;             ///< the worse of the two bones'
    std::optional<RigidTransform> proximal_from_distal;    ///< between their axes; none where a pose is missing
    Eigen::Vector3d angles_rad = Eigen::Vector3d::Zero();  ///< cardan_angles_rad
    /// Of the motion since the joint's first row with a pose, in the proximal axes.
    HelicalAxis helical;
};

/// One joint through all frames:
///   proximal_from_distal = (world_from_ct * ct_from_axes of the proximal bone)^-1
///                          * world_from_ct * ct_from_axes of the distal one.
[[nodiscard]] std::vector<JointRow> joint_rows(const std::vector<TrajectoryRow>& trajectory,
                                               const TrackObject& proximal, const TrackObject& distal,
                                               const CardanSequence& sequence);

/// joint_PROXIMAL_DISTAL.csv: frame, status, the three angles [deg] under the names of their axes, translation [mm],
/// helical angle, shift, direction and point. Cells of rows without a pose are empty.
[[nodiscard]] std::string joint_csv(const std::vector<JointRow>& rows, const CardanSequence& sequence);

}  // namespace raylign::detail::apps

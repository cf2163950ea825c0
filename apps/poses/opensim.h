#pragma once

#include <span>
#include <string>

#include "raylign/io/trajectory.h"

namespace raylign::detail::apps {

/// A storage file of OpenSim (.mot, .sto): a row a frame, tabs; time [s] from the first frame, and for each object what
/// a FreeJoint has: NAME_rx, NAME_ry, NAME_rz [degrees], R = Rx Ry Rz (body-fixed), and NAME_tx, NAME_ty, NAME_tz [m],
/// the pose of ct in world. "nan" where there is no pose. `name`: the first line. `rate_hz`: frames a second.
[[nodiscard]] std::string opensim_storage_text(std::span<const PoseSequence> sequences, const std::string& name,
                                               double rate_hz);

/// A marker file of OpenSim (.trc), mm: for each object four markers, its origin NAME_o and the points at 50 mm on its
/// axes NAME_x, NAME_y, NAME_z, in world; empty cells where there is no pose.
[[nodiscard]] std::string opensim_markers_text(std::span<const PoseSequence> sequences, const std::string& name,
                                               double rate_hz);

}  // namespace raylign::detail::apps

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/shared/flags.h"
#include "core/base/random.h"
#include "core/io/volumes/labelled_objects.h"
#include "raylign/rigid_transform.h"
#include "raylign/volume.h"

namespace raylign::detail::apps {

/// Objects of a label map that a simulation moves.
struct ArticulationFlags {
    std::vector<std::string> moves;  ///< NAME or NAME=FILE, NAME a label by name or number
    std::string by;                  ///< "MM,DEG": largest random shift and turn; "" = 5,5
};

/// Largest random shift and turn, per axis.
struct MotionLimits {
    double mm = 5, deg = 5;
};
/// Of --by. Throws Error for another form, and values out of range.
[[nodiscard]] MotionLimits motion_limits(const ArticulationFlags& flags);

/// A rigid motion about a point, each of whose six components is uniform within the limits.
[[nodiscard]] RigidTransform random_motion(const MotionLimits& limits, const Eigen::Vector3d& centre_world_mm,
                                           Random& random);

/// What --move names of a CT, and the rest: where an object was, soft tissue takes its place (labelled_objects.h).
/// Throws Error as cut_objects does.
[[nodiscard]] LabelledObjects cut_moving(const ArticulationFlags& flags, const VolumeFlags& volume, const Volume& ct);

/// One object and where it is.
struct PlacedObject {
    std::string name;  ///< "rest" for what does not move
    Volume volume;
    RigidTransform world_from_ct;
};

/// Throws Error for --move without a map, and --by without --move.
void settle_conflicts(const ArticulationFlags& flags, const VolumeFlags& volume);

/// The parts of a CT: what is left at `world_from_ct`, every object named at the pose in its file, or moved from there
/// by a random rigid motion about its centre: of `seed` and the object's place among --move. Throws Error as
/// cut_objects and read_pose do.
[[nodiscard]] std::vector<PlacedObject> articulated(const ArticulationFlags& flags, const VolumeFlags& volume,
                                                    const Volume& ct, const RigidTransform& world_from_ct,
                                                    std::uint64_t seed);

}  // namespace raylign::detail::apps

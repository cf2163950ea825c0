#pragma once

#include "core/registration/object/resident_volume.h"
#include "raylign/registration.h"

namespace raylign::detail {

/// Throws Error for options out of range, and for a search on a backend without derivatives.
void check_options(const RegistrationOptions& options, const Backend& backend);

/// register_volume on a volume that stays resident: nothing of it is read, halved or laid out anew. Same result, bit
/// for bit. Throws Error also where options.render differs from the volume's.
[[nodiscard]] RegistrationResult register_resident(ResidentVolume& volume, std::span<const View> views,
                                                   const RigidTransform& start_world_from_ct,
                                                   const RegistrationOptions& options, const RunControl& control = {});

/// A part in a sequence: one level alone from a prediction that is right to about a millimetre (strategy/follow.h),
/// judged as register_resident judges a part that was not searched for, by the costs of that level. Throws Error as
/// register_resident does, and where the backend gives no derivatives.
[[nodiscard]] RegistrationResult follow_resident(ResidentVolume& volume, std::span<const View> views,
                                                 const RigidTransform& prediction_world_from_ct,
                                                 const RegistrationOptions& options, int coarser_by,
                                                 const RunControl& control = {});

/// register_resident with options.refine_views: registers with the cameras as given, solves for pose and cameras from
/// there, and registers once more with the corrected cameras.
[[nodiscard]] RegistrationResult register_refined(ResidentVolume& volume, std::span<const View> views,
                                                  const RigidTransform& start_world_from_ct,
                                                  const RegistrationOptions& options, const RunControl& control);

}  // namespace raylign::detail

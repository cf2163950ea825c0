#pragma once

#include <string>

#include "apps/shared/flags.h"
#include "raylign/backends.h"
#include "raylign/io/volume.h"
#include "raylign/registration.h"

namespace raylign::detail::apps {

// All conflicts between flags are settled here: each throws Error for flags that contradict each other or would be
// ignored, before any file is read.
void settle_conflicts(const VolumeFlags& flags);
void settle_conflicts(const BackendFlags& flags);
void settle_conflicts(const SearchFlags& search, const MethodFlags& method);
void settle_conflicts(const StartFlags& flags);

// Flags to the library's own options; unknown names throw Error listing the valid ones.
[[nodiscard]] VolumeReadOptions volume_read_options(const VolumeFlags& flags);
[[nodiscard]] RenderSettings render_settings(const BackendFlags& flags);
[[nodiscard]] BackendOptions backend_options(const BackendFlags& flags);
[[nodiscard]] RegistrationOptions registration_options(const MethodFlags& method, const SearchFlags& search,
                                                       const BackendFlags& backend);

/// The flags for another backend. "gl-2006-mipmap" is gl-2006 with --reduction mipmap, Chisu's baseline in the paper: a
/// name of its own, so that one study can hold both.
[[nodiscard]] BackendFlags with_backend(BackendFlags flags, const std::string& name);

/// The backend that the flags name. Throws Error, kind unavailable, where --device names something the chosen one
/// lacks.
[[nodiscard]] BackendChoice choose_backend(const BackendFlags& flags);

/// A backend that a run of several goes without.
struct LeftOut {
    std::string name, reason;
};

}  // namespace raylign::detail::apps

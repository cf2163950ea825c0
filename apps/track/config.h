#pragma once

#include <string>

#include "apps/track/inputs.h"
#include "raylign/backend.h"

namespace raylign::detail::apps {

/// What every frame of a track depends on, whichever of them are tracked and wherever from: inputs without poses,
/// objects, options, backend. JSON in one line.
[[nodiscard]] std::string track_config(const TrackCommandOptions& options, const TrackInputs& inputs,
                                       const BackendInfo& backend);

}  // namespace raylign::detail::apps

#pragma once

#include <optional>
#include <span>
#include <string>

#include "raylign/view.h"
#include "core/registration/registration.h"

namespace raylign {

/// The view as its observer's image: columns reversed, image and weights alike. The camera stays.
[[nodiscard]] View with_columns_reversed(View view);

/// For a result that correlates weakly: whether the images fit far better with the columns of some views reversed; all
/// subsets of up to three views are tried, none of more. X-rays are stored as the source or as an observer sees them,
/// and files do not always say which. Says so in words for people, naming views and costs; nothing is changed. Each try
/// is a registration of its own. Throws as register_volume does.
[[nodiscard]] std::optional<std::string> mirror_suspicion(ResidentVolume& volume, std::span<const View> views,
                                                          const RigidTransform& start_world_from_ct,
                                                          const RegistrationOptions& options,
                                                          const RegistrationResult& found,
                                                          const ProgressCallback& progress = {});

}  // namespace raylign

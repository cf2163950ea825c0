#pragma once

#include "core/registration/level/level.h"

namespace raylign::detail {

/// Of a part in one view: fits beside the pose by how much the X-ray compresses the part's contrast (trust/response.h),
/// step by step, each followed by a descent with the DRR compressed alike; weights stay. The level and the pose are
/// those of the end. How far that moved the pose (rad, mm, about the object's centre, in world). Nothing is done where
/// the view has a ceiling already or no contrast is found to be compressed.
[[nodiscard]] Twist fit_contrast(Run& run, Level& level);

}  // namespace raylign::detail

#pragma once

#include "raylign/io/volume.h"

namespace raylign::detail {

/// Applies options.object to a volume as read, crops it to what is left, and says so in its notes. Throws Error where
/// nothing is left, with the step after which.
void keep_object(const VolumeReadOptions& options, VolumeFile& file);

}  // namespace raylign::detail

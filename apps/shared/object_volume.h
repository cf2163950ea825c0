#pragma once

#include <functional>
#include <span>
#include <string>

#include "apps/shared/flags.h"
#include "raylign/io/volume.h"
#include "raylign/view.h"

namespace raylign::detail::apps {

/// What --material says of one object: "NAME=MATERIAL" or, for all without such a word, "MATERIAL"; "" where it says
/// nothing. Throws Error where it says it twice.
[[nodiscard]] std::string material_of(const std::vector<std::string>& materials, const std::string& object);

/// Reads the volume that the flags name. A model without --mesh-spacing gets voxels two thirds as large as a pixel of
/// the finest view where `place` (asked with a grid of one voxel in the model's middle) puts it.
[[nodiscard]] VolumeFile read_object_volume(const VolumeFlags& flags, std::span<const View> views,
                                            const std::function<RigidTransform(const VoxelGrid&)>& place);

}  // namespace raylign::detail::apps

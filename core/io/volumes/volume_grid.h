#pragma once

#include <filesystem>

#include "raylign/io/volume.h"

namespace raylign::detail {

/// Where the voxels of a volume lie, as read_volume finds it: for poses that are told in the frame of a volume. Of the
/// options series and spacing count.
[[nodiscard]] VoxelGrid read_volume_grid(const std::filesystem::path& path, const VolumeReadOptions& options = {});

}  // namespace raylign::detail

#pragma once

#include <filesystem>

#include "core/io/meshes/triangle_mesh.h"
#include "raylign/io/volume.h"

namespace raylign::detail {

/// A mesh file, or a list of parts (docs/formats.md, "Parts").
[[nodiscard]] bool is_model_file(const std::filesystem::path& path);

/// Where the parts of a model lie, all of them read: what a spacing is chosen for. Throws Error as read_model does.
[[nodiscard]] MeshBounds model_bounds(const std::filesystem::path& path, const VolumeReadOptions& options);

/// Attenuation of a model's parts on a grid around them: of each voxel the share that a part fills, of the material it
/// is made of; where parts lie in one another the first of them has the place.
[[nodiscard]] VolumeFile read_model(const std::filesystem::path& path, const VolumeReadOptions& options);

}  // namespace raylign::detail

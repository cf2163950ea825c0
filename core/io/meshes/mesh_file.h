#pragma once

#include <filesystem>

#include "core/io/meshes/triangle_mesh.h"

namespace raylign::detail {

/// STL (binary, ASCII), OBJ or PLY, by the extension in any case of letters.
[[nodiscard]] bool is_mesh_file(const std::filesystem::path& path);

/// The triangles of such a file in its own unit, polygons cut into triangles. Throws Error for a file that is missing,
/// damaged or has no surface. Whether the surface is of any use is for solid_of to say.
[[nodiscard]] TriangleMesh read_mesh(const std::filesystem::path& path);

}  // namespace raylign::detail

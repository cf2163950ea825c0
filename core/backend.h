#pragma once

#include <string>
#include <string_view>

#include "core/geometry/ray_frame.h"
#include "core/similarity/linearization.h"
#include "core/similarity/similarity.h"
#include "raylign/backend.h"

namespace raylign::detail {

/// The step in mm that a trilinear ray takes: settings.step_mm, or half the smallest voxel side where that is 0.
[[nodiscard]] double trilinear_step_mm(const RenderSettings& settings, const VoxelGrid& grid);
/// The finest step that check_render allows: a hundredth of a voxel.
[[nodiscard]] double finest_step_mm(const VoxelGrid& grid);

/// Throws Error for an empty or too large grid, sizes that disagree, bad spacing or direction, non-finite voxels, no
/// views, bad cameras, a bad step. Views may lack images (drr): then only render works. Constant images and masks are
/// checked where the channels are made (make_fixed_channels).
void check_scene(const Scene& scene);

/// The parts of check_scene that look at the views and at the step.
void check_views(std::span<const View> views);
void check_render(const RenderSettings& render, const VoxelGrid& grid);

/// Source and volume at most so far apart along each axis: doubles still tell a millionth of a voxel there. From 2^53
/// steps on, backends could no longer count samples.
inline constexpr double kFarthestSource_voxels = 1e9;

/// Throws Error for sizes, spacing, direction or voxels that no backend can work with. `where` names the file.
void check_volume(const Volume& volume, std::string_view where);
/// The same without a look at the voxels.
void check_shape(const Volume& volume, std::string_view where);

/// For messages: "1.000000 2.000000 3.000000".
[[nodiscard]] std::string vector_text(const Eigen::Vector3d& v);

}  // namespace raylign::detail

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "raylign/grid.h"
#include "raylign/volume.h"

namespace raylign::detail {

/// The smallest box that holds every voxel with another value than 0. Throws Error where there is none.
[[nodiscard]] VoxelBox box_of_object(const Volume& volume);

/// The voxels of `box` as a volume of its own, in their place: the new origin is the centre of voxel `box.begin`. The
/// field outside becomes 0. Cropping to box_of_object leaves the field as it was. Throws Error for a box that is empty
/// or reaches beyond the grid.
[[nodiscard]] Volume crop(const Volume& volume, const VoxelBox& box);

/// Sets every voxel to what it exceeds `attenuation_per_mm` by, at least 0: bone's contrast to the soft tissue around
/// it, which is what an X-ray of the whole body shows of it, without the jump at its surface that a threshold makes.
void contrast_above(Volume& volume, float attenuation_per_mm);

/// Lowers every voxel above `attenuation_per_mm` to it: metal and its artefacts no longer outshine bone.
void clip_above(Volume& volume, float attenuation_per_mm);

/// Sets 0 every voxel whose centre lies outside `box`. Throws Error where no voxel's centre lies inside, or low > high.
void keep_inside(Volume& volume, const CtBox& box);

/// Fades tissue out towards the faces that cut it, linearly over `width_mm`: a voxel at distance d inside a face is
/// multiplied by min(1, d / width_mm), for each face near it. A cut face is an edge that no X-ray shows. The first
/// fades towards the faces of `box`, the second towards the outermost voxels' outer sides. Throws Error for a width
/// that is not positive.
void fade_faces(Volume& volume, const CtBox& box, double width_mm);
void fade_sides(Volume& volume, double width_mm);

/// Sets 0 every voxel whose label is none of `kept`. A map on another grid gives each voxel the label nearest to its
/// centre, and 0 beyond its border. Throws Error where a label of `kept` is absent from the map (its message lists
/// those present), where the map says nothing about the volume (they do not overlap), or for a label of 0.
void keep_labels(Volume& volume, const LabelMap& map, std::span<const std::int32_t> kept);

}  // namespace raylign::detail

#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <optional>
#include <span>
#include <vector>

#include "core/image/gradient_filter.h"
#include "core/registration/object/pose_space.h"
#include "raylign/view.h"
#include "raylign/volume.h"

namespace raylign::detail {

/// One resolution of the pyramid: how often volume and images are halved, and the filter that goes with it.
struct LevelPlan {
    int volume_halvings = 0;
    std::vector<int> image_halvings;  ///< per view
    GradientFilter filter;
    bool is_finest = true;          ///< of its pyramid
    double pixel_at_object_mm = 0;  ///< the finest over views: the level's unit of length
};

/// The levels, coarsest first. Each view's finest level is the first whose pixel, projected to the object, is at least
/// half a voxel wide (finer pixels hold nothing that the CT could explain); each coarser one halves it, as long as the
/// smaller image side has at least 32 px, the object's thinnest direction at least 8 px (a bone that is a speck sends
/// the search to the wrong place) and every mask leaves at least 400 px, or until there are `levels` of them. The
/// volume is halved until its voxel fits the pixel, or half of it where a view has a ceiling.
[[nodiscard]] std::vector<LevelPlan> plan_levels(const Volume& volume, std::span<const View> views,
                                                 const RigidTransform& world_from_ct, const ObjectExtent& extent,
                                                 const GradientFilter& finest_filter, std::optional<int> levels);

/// Of levels, coarsest first, the one that is this much coarser than the finest, as far as there are any.
template <class Levels>
[[nodiscard]] const auto& coarser(const Levels& levels, int coarser_by) {
    const std::ptrdiff_t last = std::ssize(levels) - 1;
    return levels[static_cast<std::size_t>(last - std::clamp<std::ptrdiff_t>(coarser_by, 0, last))];
}

/// Of an object's own levels the halvings of the one whose images are the plan's, or the nearest to it.
[[nodiscard]] int volume_halvings_like(const std::vector<LevelPlan>& own, const LevelPlan& plan);

/// Only where the views look from: for one level alone, where it is seen whether masks leave enough when it is made.
[[nodiscard]] std::vector<View> bare(std::span<const View> views);

}  // namespace raylign::detail

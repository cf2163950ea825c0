#pragma once

#include <compare>
#include <optional>
#include <span>
#include <vector>

#include "core/registration/object/resident_volume.h"
#include "raylign/image.h"
#include "raylign/view.h"

namespace raylign::detail {

/// What the objects of a scene show at their poses in the views.
struct Shown {
    std::vector<std::vector<Image>> drrs;  ///< per object and view
    std::vector<double> gains;             ///< per view, by which the sum of them fits the X-ray best
    std::vector<int> halvings = {};        ///< per view: how often it is halved for them; empty = they are as given
};

/// How finely an object is drawn.
struct Fineness {
    int volume_halvings = 0;
    std::vector<int> image_halvings;  ///< per view

    auto operator<=>(const Fineness&) const = default;
};

/// DRRs of the views at the pose.
[[nodiscard]] std::vector<Image> drawn(ResidentVolume& volume, const RigidTransform& world_from_ct,
                                       std::span<const View> views, const Fineness& fineness);

/// The views less what all objects but `kept` show, times the gain; nothing kept: less what all show. Of coarser DRRs
/// every pixel is taken from all those that are halved to it: so halved, a view is less just what they show.
[[nodiscard]] std::vector<View> remainder(std::span<const View> views, const Shown& shown,
                                          std::optional<std::size_t> kept);

}  // namespace raylign::detail
